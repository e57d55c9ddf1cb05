#include "terrain/store/ledger_entry.h"

#include <cstddef>
#include <cstring>

#include "terrain/base/hash.h"

namespace tind {

namespace {

constexpr std::uint32_t kNotOneSided = 1;

struct Place {
  std::uint32_t level = 0, x = 0, y = 0, flags = 0;
  std::uint64_t size = 0, hash_low = 0, hash_high = 0;
  double max_error_m = 0, edge_error_m = 0;
  std::uint64_t own_hash = 0;  // of what stands before, with the seed
};
static_assert(sizeof(Place) == kLedgerPlace);

std::uint64_t hash_of(const Place& place, std::uint64_t seed) {
  return hash64({&place, offsetof(Place, own_hash)}, seed);
}

}  // namespace

void LedgerEntry::take(std::string_view stored) {
  const Hash128 h = hash128(stored);
  facts.size = stored.size(), hash_low = h.low, hash_high = h.high;
}

bool LedgerEntry::vouches_for(std::string_view stored) const {
  if (stored.size() != facts.size) return false;
  LedgerEntry found;
  found.take(stored);
  return found.hash_low == hash_low && found.hash_high == hash_high;
}

std::string encode_place(const LedgerEntry& e, std::uint64_t seed) {
  Place p{.level = std::uint32_t(e.id.level),
          .x = e.id.x,
          .y = e.id.y,
          .flags = e.facts.not_one_sided ? kNotOneSided : 0,
          .size = e.facts.size,
          .hash_low = e.hash_low,
          .hash_high = e.hash_high,
          .max_error_m = e.facts.max_error_m,
          .edge_error_m = e.facts.edge_error_m};
  p.own_hash = hash_of(p, seed);
  return {reinterpret_cast<const char*>(&p), sizeof p};
}

std::optional<LedgerEntry> decode_place(std::string_view bytes, TileId id, std::uint64_t seed) {
  Place p;
  if (bytes.size() != sizeof p) return {};
  std::memcpy(&p, bytes.data(), sizeof p);
  if (hash_of(p, seed) != p.own_hash) return {};
  if (p.level != std::uint32_t(id.level) || p.x != id.x || p.y != id.y) return {};
  return LedgerEntry{.id = id,
                     .facts = {.size = p.size,
                               .max_error_m = p.max_error_m,
                               .edge_error_m = p.edge_error_m,
                               .not_one_sided = (p.flags & kNotOneSided) != 0},
                     .hash_low = p.hash_low,
                     .hash_high = p.hash_high};
}

}  // namespace tind
