#include "terrain/store/pmtiles/pmtiles_seal.h"

#include "terrain/base/bytes.h"
#include "terrain/base/hash.h"

namespace tind::pmtiles {

namespace {

constexpr std::string_view kMagic = "tindSEAL";

std::string without_hash(const Seal& s) {
  std::string bytes;
  ByteWriter<std::string> out(bytes);
  out.put_text(kMagic);
  out.put(std::uint64_t(kVersion));
  for (const std::uint64_t n : {s.tiles, s.entries_at, s.entries_hash, s.blocks_size, s.blocks_hash,
                                s.head_hash, s.leaves_hash, s.leaf_entries})
    out.put(n);
  return bytes;
}

}  // namespace

std::uint64_t Seal::hash() const { return hash64(without_hash(*this)); }

std::string encode(const Seal& seal) {
  std::string bytes = without_hash(seal);
  ByteWriter<std::string>(bytes).put(seal.hash());
  return bytes;
}

std::optional<Seal> decode_seal(std::string_view bytes) {
  ByteReader in(bytes);
  if (in.get_text(kMagic.size()) != kMagic || in.get<std::uint64_t>() != kVersion) return {};
  Seal s;
  for (std::uint64_t* n : {&s.tiles, &s.entries_at, &s.entries_hash, &s.blocks_size, &s.blocks_hash,
                           &s.head_hash, &s.leaves_hash, &s.leaf_entries})
    *n = in.get<std::uint64_t>();
  if (in.get<std::uint64_t>() != s.hash() || !in.good() || in.left() > 0) return {};
  return s;
}

std::optional<TileId> tile_of(const proto::PmtilesPlace& p) {
  if (p.zoom < 1 || p.zoom > tiling::kMaxLevel + 1) return {};
  const int level = p.zoom - 1;
  return tiling::tile(level, p.x, std::int64_t(tiling::rows(level)) - 1 - p.y);
}

}  // namespace tind::pmtiles
