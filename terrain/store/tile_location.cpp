#include "terrain/store/tile_location.h"

#include <charconv>
#include <fstream>

#include "terrain/base/deflate.h"
#include "terrain/raster/gdal/gdal_http.h"

namespace tind {

namespace {

constexpr std::size_t kLargestFile = 64u << 20;
// What globe clients send; servers leave the extensions out for who does not ask.
constexpr const char* kAccept =
    "application/vnd.quantized-mesh;extensions=octvertexnormals-watermask-metadata,"
    "application/octet-stream;q=0.9,*/*;q=0.1";

bool is_url(const std::string& text) {
  return text.starts_with("http://") || text.starts_with("https://");
}

std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || std::to_string(value) != text)
    return std::nullopt;
  return value;
}

void replace(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

Result<std::vector<std::uint8_t>> read_file(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    const bool missing = error == std::errc::no_such_file_or_directory;
    return fail(missing ? Errc::not_found : Errc::io, path + ": " + error.message());
  }
  if (size > kLargestFile) return fail(Errc::bad_data, path + " is too large for a tile");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(size)))
    return fail(Errc::io, "cannot read " + path);
  return bytes;
}

}  // namespace

TileLocation::TileLocation(const std::string& text) : base_(text), remote_(is_url(text)) {
  const std::size_t query = remote_ ? base_.find_first_of("?#") : std::string::npos;
  if (query != std::string::npos) base_.resize(query);
  if (base_.ends_with("/layer.json")) base_.resize(base_.size() - 11);
  while (base_.size() > 1 && base_.ends_with('/')) base_.pop_back();
}

void TileLocation::use_template(const std::string& text, const std::string& version) {
  template_ = text;
  replace(template_, "{version}", version);
}

std::string TileLocation::tile(TileId id) const {
  if (!remote_ || template_.empty()) return file(id.text() + ".terrain");
  std::string path = template_;
  replace(path, "{z}", std::to_string(id.level));
  replace(path, "{x}", std::to_string(id.x));
  replace(path, "{y}", std::to_string(id.y));
  if (is_url(path)) return path;
  if (path.starts_with('/')) return base_.substr(0, base_.find('/', base_.find("//") + 2)) + path;
  return file(path);
}

Result<std::vector<std::uint8_t>> TileLocation::read(const std::string& path) const {
  return remote_ ? fetch_url(path, kAccept) : read_file(path);
}

std::optional<TileId> tile_of_path(const std::filesystem::path& relative) {
  std::vector<std::string> parts;
  for (const auto& part : relative) parts.push_back(part.string());
  if (parts.size() != 3 || relative.extension() != ".terrain") return std::nullopt;
  const auto z = whole_number(parts[0]), x = whole_number(parts[1]);
  const auto y = whole_number(relative.stem().string());
  if (!z || !x || !y) return std::nullopt;
  return tiling::tile(*z, *x, *y);
}

bool gunzip(std::vector<std::uint8_t>& bytes) {
  if (!is_gzip(bytes)) return true;
  auto out = gunzip(bytes, kLargestFile);
  if (out) bytes = std::move(*out);
  return out.has_value();
}

}  // namespace tind
