// Any text: no crash; what decodes is encoded again to what it was, and gives its tiles away.

#include <cstdlib>

#include "terrain/pyramid/shards/shard_files.h"
#include "terrain/pyramid/shards/shard_plan.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  if (const auto record = decode_shard_record(text); record && encode(*record) != text)
    std::abort();
  const auto plan = decode_shard_plan(text);
  if (!plan) {
    if (plan.error().what.empty()) std::abort();
    return 0;
  }
  const auto again = decode_shard_plan(encode(*plan));
  if (!again || again->hash() != plan->hash()) std::abort();
  const auto tiles = ShardTiles::of(*plan);
  if (!tiles) std::abort();
  if (plan->tiles() > 1'000'000) return 0;
  std::uint64_t count = tiles->in_order(ShardTiles::kTop).size();
  for (std::size_t i = 0; i < plan->shards.size(); ++i) count += tiles->in_order(i).size();
  if (count != plan->tiles()) std::abort();
  return 0;
}
