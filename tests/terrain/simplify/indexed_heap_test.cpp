#include "terrain/simplify/indexed_heap.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace tind {
namespace {

TEST(IndexedHeap, AlwaysGivesTheSmallestWhateverWasReKeyedOrRemoved) {
  std::mt19937 random(3);
  IndexedHeap<int> heap(200);
  std::map<std::uint32_t, int> model;
  for (std::uint32_t i = 0; i < 100; ++i) {
    model[i] = int(random() % 50);
    heap.append(i, model[i]);
  }
  heap.heapify();
  for (int round = 0; round < 20000; ++round) {
    const std::uint32_t item = random() % 200;
    if (random() % 3 == 0) {
      heap.remove(item);
      model.erase(item);
    } else {
      const int key = int(random() % 50);
      heap.set(item, key);
      model[item] = key;
    }
    ASSERT_EQ(heap.empty(), model.empty());
    if (model.empty()) continue;
    std::pair<int, std::uint32_t> least{1 << 30, 0};
    for (const auto& [i, key] : model) least = std::min(least, {key, scatter(i)});
    ASSERT_EQ(heap.key(heap.top()), least.first);
    ASSERT_EQ(scatter(heap.top()), least.second);
  }
}

}  // namespace
}  // namespace tind
