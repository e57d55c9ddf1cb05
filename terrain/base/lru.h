#pragma once
// What was used last, within a bound: the one cache policy of the program.

#include <cstddef>
#include <iterator>
#include <list>
#include <map>
#include <unordered_map>
#include <utility>

namespace tind {

namespace detail {
template <class Key, class Place, class Hash>
struct LruIndex {
  using Type = std::unordered_map<Key, Place, Hash>;
};
template <class Key, class Place>
struct LruIndex<Key, Place, void> {
  using Type = std::map<Key, Place>;
};
}  // namespace detail

/// Values by key, each with a weight (bytes, or 1 to count them). When their sum is above the
/// bound, the least recently used go. Not thread-safe: its owner has the lock, and may destroy what
/// went after giving it back. With a `Hash` keys are found by hash, else by their order.
template <class Key, class Value, class Hash = void>
class Lru {
 public:
  struct Entry {
    Key key;
    Value value;
    std::size_t weight = 1;
  };
  using Entries = std::list<Entry>;

  /// The `always` most recently used ones stay, whatever they weigh.
  explicit Lru(std::size_t most_weight, std::size_t always = 0)
      : most_weight_(most_weight), always_(always) {}

  /// nullptr where it is not here. Counts as a use; the pointer is good until the next insert.
  Value* find(const Key& key) {
    const auto found = index_.find(key);
    if (found == index_.end()) return nullptr;
    recent_.splice(recent_.begin(), recent_, found->second);
    return &found->second->value;
  }
  /// The same, and does not count as a use.
  const Value* peek(const Key& key) const {
    const auto found = index_.find(key);
    return found == index_.end() ? nullptr : &found->second->value;
  }

  /// In place of what has this key. Gives back what had to go, which may be the new one.
  Entries insert(const Key& key, Value value, std::size_t weight = 1) {
    if (const auto old = index_.find(key); old != index_.end()) {
      weight_ -= old->second->weight;
      recent_.erase(old->second);
      index_.erase(old);
    }
    recent_.push_front({key, std::move(value), weight});
    index_.emplace(key, recent_.begin());
    weight_ += weight;
    Entries gone;
    while (weight_ > most_weight_ && recent_.size() > always_) {
      weight_ -= recent_.back().weight;
      index_.erase(recent_.back().key);
      gone.splice(gone.end(), recent_, std::prev(recent_.end()));
    }
    return gone;
  }

  /// Takes out and gives back those whose key `goes` says yes to. Looks at all.
  template <class Goes>
  Entries take_if(Goes&& goes) {
    Entries taken;
    for (auto it = recent_.begin(); it != recent_.end();) {
      const auto here = it++;
      if (!goes(std::as_const(here->key))) continue;
      weight_ -= here->weight;
      index_.erase(here->key);
      taken.splice(taken.end(), recent_, here);
    }
    return taken;
  }

  /// Most recently used first.
  const Entries& entries() const { return recent_; }
  std::size_t weight() const { return weight_; }
  std::size_t size() const { return recent_.size(); }

 private:
  std::size_t most_weight_, always_, weight_ = 0;
  Entries recent_;  // front: used last
  typename detail::LruIndex<Key, typename Entries::iterator, Hash>::Type index_;
};

}  // namespace tind
