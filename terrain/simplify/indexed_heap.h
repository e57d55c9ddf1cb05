#pragma once
// A binary min-heap of items 0..n-1 by key, in which any item can be re-keyed or taken out.
//
// Equal keys leave in the order of their tie number, so the order never depends on history. One
// entry an item: memory is 8 bytes an item plus its key. All edits O(log n).

#include <cstdint>
#include <utility>
#include <vector>

namespace tind {

/// Spreads consecutive numbers, so that items with equal keys are not taken in a sweep.
inline std::uint32_t scatter(std::uint32_t i) { return i * 2654435769u; }

template <class Key>
class IndexedHeap {
 public:
  explicit IndexedHeap(std::size_t items) : key_(items), place_(items, kOut) {
    heap_.reserve(items);
  }

  bool empty() const { return heap_.empty(); }
  bool contains(std::uint32_t item) const { return place_[item] != kOut; }
  std::uint32_t top() const { return heap_[0]; }
  const Key& key(std::uint32_t item) const { return key_[item]; }

  /// Appends without ordering; call heapify() after the last one.
  void append(std::uint32_t item, Key key) {
    key_[item] = key;
    place_[item] = std::uint32_t(heap_.size());
    heap_.push_back(item);
  }
  void heapify() {
    for (std::size_t i = heap_.size() / 2; i-- > 0;) sift_down(std::uint32_t(i));
  }

  /// Inserts the item, or changes its key.
  void set(std::uint32_t item, Key key) {
    if (!contains(item)) {
      append(item, key);
      sift_up(place_[item]);
      return;
    }
    const bool smaller = key < key_[item];
    key_[item] = key;
    if (smaller)
      sift_up(place_[item]);
    else
      sift_down(place_[item]);
  }

  void remove(std::uint32_t item) {
    if (!contains(item)) return;
    const std::uint32_t hole = place_[item];
    place_[item] = kOut;
    const std::uint32_t last = heap_.back();
    heap_.pop_back();
    if (last == item) return;
    put(hole, last);
    sift_up(hole);
    sift_down(place_[last]);
  }

 private:
  static constexpr std::uint32_t kOut = ~0u;
  std::vector<Key> key_;
  std::vector<std::uint32_t> place_, heap_;

  bool before(std::uint32_t a, std::uint32_t b) const {
    if (key_[a] < key_[b]) return true;
    if (key_[b] < key_[a]) return false;
    return scatter(a) < scatter(b);
  }
  void put(std::uint32_t place, std::uint32_t item) {
    heap_[place] = item;
    place_[item] = place;
  }
  void sift_up(std::uint32_t i) {
    const std::uint32_t item = heap_[i];
    for (; i > 0 && before(item, heap_[(i - 1) / 2]); i = (i - 1) / 2) put(i, heap_[(i - 1) / 2]);
    put(i, item);
  }
  void sift_down(std::uint32_t i) {
    const std::uint32_t item = heap_[i], n = std::uint32_t(heap_.size());
    for (std::uint32_t child; (child = 2 * i + 1) < n; i = child) {
      if (child + 1 < n && before(heap_[child + 1], heap_[child])) ++child;
      if (!before(heap_[child], item)) break;
      put(i, heap_[child]);
    }
    put(i, item);
  }
};

}  // namespace tind
