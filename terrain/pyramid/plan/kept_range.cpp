// A line that says of what it is, then numbers, then a hash of both.

#include "terrain/pyramid/plan/kept_range.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string_view>

#include "terrain/base/bytes.h"
#include "terrain/base/file_io.h"
#include "terrain/base/hash.h"

namespace tind {

namespace {

constexpr std::size_t kDigits = 32;
constexpr std::uint32_t kMostLevels = 64;

/// The range of a level is that of its area, which goes by where each layer ends.
std::string line_of(const Surface& surface, const TilePlan& outline) {
  std::string line =
      fmt::format("tind range 1 {} {}", surface.info().fingerprint, outline.max_level());
  for (std::size_t k = 0; k < surface.layers().size(); ++k)
    line += fmt::format(" {}", outline.deepest_of(k));
  return line + "\n";
}

void put(ByteWriter<std::string>& out, const std::optional<PostPlace>& place) {
  out.put(std::uint8_t(place.has_value()));
  const PostPlace p = place.value_or(PostPlace{});
  out.put(std::uint64_t(p.layer));
  out.put(p.col);
  out.put(p.row);
}

std::optional<PostPlace> get_place(ByteReader& in) {
  const bool there = in.get<std::uint8_t>() != 0;
  PostPlace p;
  p.layer = std::size_t(in.get<std::uint64_t>());
  p.col = in.get<std::int64_t>();
  p.row = in.get<std::int64_t>();
  return there ? std::optional(p) : std::nullopt;
}

}  // namespace

Result<KeptRange> read_kept_range(const std::string& path, const Surface& surface,
                                  const TilePlan& outline) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return fail(Errc::not_found, path + ": is not there");
  const auto text = read_regular_file(path);
  if (!text) return std::unexpected(text.error());
  const auto bad = fail(Errc::bad_data, path + ": not the range of this surface");
  const std::string line = line_of(surface, outline);
  if (!text->starts_with(line) || text->size() < line.size() + sizeof(std::uint64_t)) return bad;
  const auto said = std::string_view(*text).substr(0, text->size() - sizeof(std::uint64_t));
  ByteReader end(std::string_view(*text).substr(said.size()));
  if (end.get<std::uint64_t>() != hash64(said)) return bad;
  ByteReader in(said.substr(line.size()));
  KeptRange kept;
  HeightRange& r = kept.range;
  r.min_m = in.get<double>(), r.max_m = in.get<double>(), r.valid = in.get<std::uint64_t>();
  r.lowest = get_place(in), r.highest = get_place(in);
  const auto levels = in.get<std::uint32_t>();
  if (!in.good() || levels > kMostLevels) return bad;
  for (std::uint32_t z = 0; z < levels; ++z) {
    const double low = in.get<double>();
    r.of_levels.emplace_back(low, in.get<double>());
  }
  kept.content = in.get_text(kDigits);
  if (!in.good() || in.left() > 0) return bad;
  return kept;
}

Result<void> keep_range(const std::string& path, const Surface& surface, const TilePlan& outline,
                        const KeptRange& kept) {
  std::string bytes = line_of(surface, outline);
  ByteWriter out(bytes);
  const HeightRange& r = kept.range;
  out.put(r.min_m);
  out.put(r.max_m);
  out.put(r.valid);
  put(out, r.lowest);
  put(out, r.highest);
  out.put(std::uint32_t(r.of_levels.size()));
  for (const auto& [low, high] : r.of_levels) out.put(low), out.put(high);
  out.put_text(kept.content);
  out.put(hash64(bytes));
  return write_whole_file(path, bytes);
}

}  // namespace tind
