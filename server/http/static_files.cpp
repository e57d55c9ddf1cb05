#include "server/http/static_files.h"

#include <filesystem>
#include <vector>

#include "terrain/base/file_io.h"
#include "terrain/base/parallel.h"

namespace tind::http {
namespace {

namespace fs = std::filesystem;

struct ContentType {
  std::string_view extension, type;
  bool compressible;
};

constexpr ContentType kTypes[] = {
    {".html", "text/html; charset=utf-8", true},
    {".js", "text/javascript; charset=utf-8", true},
    {".mjs", "text/javascript; charset=utf-8", true},
    {".css", "text/css; charset=utf-8", true},
    {".json", "application/json", true},
    {".geojson", "application/geo+json", true},
    {".map", "application/json", true},
    {".txt", "text/plain; charset=utf-8", true},
    {".md", "text/plain; charset=utf-8", true},
    {".xml", "application/xml", true},
    {".svg", "image/svg+xml", true},
    {".wasm", "application/wasm", true},
    {".glb", "model/gltf-binary", true},
    {".png", "image/png", false},
    {".jpg", "image/jpeg", false},
    {".jpeg", "image/jpeg", false},
    {".gif", "image/gif", false},
    {".webp", "image/webp", false},
    {".ico", "image/x-icon", false},
    {".ktx2", "image/ktx2", false},
    {".woff2", "font/woff2", false},
};
constexpr ContentType kOther = {"", "application/octet-stream", false};

const ContentType& type_of(std::string_view extension) {
  for (const ContentType& type : kTypes)
    if (type.extension == extension) return type;
  return kOther;
}

std::vector<fs::path> list(const fs::path& directory, std::error_code& error) {
  std::vector<fs::path> files;
  std::error_code none;  // of one that went away meanwhile
  for (fs::recursive_directory_iterator it(directory, error), end; !error && it != end;
       it.increment(error)) {
    const bool hidden = it->path().filename().string().starts_with('.');
    if (hidden && it->is_directory(none)) it.disable_recursion_pending();
    if (!hidden && !it->is_symlink(none) && it->is_regular_file(none)) files.push_back(it->path());
  }
  return files;
}

std::shared_ptr<const Representation> load_file(const fs::path& path) {
  const auto bytes = read_whole_file(path.string());
  if (!bytes) return nullptr;
  const ContentType& type = type_of(path.extension().string());
  return Representation::make(*bytes, {.content_type = type.type, .compress = type.compressible});
}

}  // namespace

Result<StaticFiles> StaticFiles::load(const std::string& directory) {
  std::error_code error;
  const std::vector<fs::path> paths = list(directory, error);
  if (error) return fail(Errc::not_found, directory + ": " + error.message());
  std::vector<std::shared_ptr<const Representation>> loaded(paths.size());
  parallel_for(paths.size(), 0, [&](std::size_t i) { loaded[i] = load_file(paths[i]); });
  StaticFiles files;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (!loaded[i]) return fail(Errc::io, "cannot read " + paths[i].string());
    files.files_[paths[i].lexically_relative(directory).generic_string()] = loaded[i];
  }
  return files;
}

std::shared_ptr<const Representation> StaticFiles::find(std::string_view name) const {
  if (const auto found = files_.find(name); found != files_.end()) return found->second;
  if (!name.empty() && !name.ends_with('/')) return nullptr;
  const auto index = files_.find(std::string(name) + "index.html");
  return index != files_.end() ? index->second : nullptr;
}

std::size_t StaticFiles::memory_bytes() const {
  std::size_t sum = 0;
  for (const auto& [name, file] : files_) sum += file->memory_bytes();
  return sum;
}

}  // namespace tind::http
