// Of several layers: the digest of each, one a line, then their blocks one after the other.

#include "terrain/surface/surface_blocks.h"

#include "terrain/base/hash.h"

namespace tind {

namespace {

constexpr std::size_t kDigest = 32;

}  // namespace

SurfaceBlocks::SurfaceBlocks(const Surface& surface) {
  for (const SurfaceLayer& layer : surface.layers()) layers_.emplace_back(layer.source->info());
}

/// All but the beginning that says what it is.
std::string SurfaceBlocks::hashes() const {
  std::string text;
  for (const SourceBlocks& layer : layers_) text += layer.digest() + "\n";
  for (const SourceBlocks& layer : layers_) text += layer.encode();
  return text;
}

std::string SurfaceBlocks::digest() const {
  return layers_.size() == 1 ? layers_[0].digest() : hash128(hashes()).text();
}

std::string SurfaceBlocks::encode() const {
  if (layers_.size() == 1) return layers_[0].encode();
  return std::string(SourceBlocks::kLayersMagic) + hashes();
}

Result<SurfaceBlocks> SurfaceBlocks::decode(std::string_view bytes, const Surface& surface,
                                            const std::string& digest) {
  SurfaceBlocks blocks(surface);
  if (surface.only()) {
    auto one = SourceBlocks::decode(bytes, surface.info(), digest);
    if (!one) return std::unexpected(one.error());
    blocks.layers_[0] = std::move(*one);
    return blocks;
  }
  const auto bad = fail(Errc::bad_data, "not the blocks of these layers");
  if (!SourceBlocks::whole(bytes, digest) || !bytes.starts_with(SourceBlocks::kLayersMagic))
    return bad;
  bytes.remove_prefix(SourceBlocks::kLayersMagic.size());
  const std::size_t count = blocks.layers_.size();
  if (bytes.size() < count * (kDigest + 1)) return bad;
  std::string_view digests = bytes.substr(0, count * (kDigest + 1));
  bytes.remove_prefix(digests.size());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t size = blocks.layers_[k].encode().size();
    if (bytes.size() < size) return bad;
    auto one = SourceBlocks::decode(bytes.substr(0, size), surface.layers()[k].source->info(),
                                    std::string(digests.substr(k * (kDigest + 1), kDigest)));
    if (!one) return std::unexpected(one.error());
    blocks.layers_[k] = std::move(*one);
    bytes.remove_prefix(size);
  }
  if (!bytes.empty()) return bad;
  return blocks;
}

}  // namespace tind
