#include "terrain/store/url/url_store.h"

#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "proto/json_text.h"
#include "terrain/raster/source_blocks.h"
#include "terrain/store/folder/folder_contents.h"

namespace tind {

namespace {

using Bytes = std::vector<std::uint8_t>;

// What globe clients send; servers leave the extensions out for who does not ask.
constexpr const char* kAccept =
    "application/vnd.quantized-mesh;extensions=octvertexnormals-watermask-metadata,"
    "application/octet-stream;q=0.9,*/*;q=0.1";

std::string without_layer(std::string url) {
  url.resize(std::min(url.size(), url.find_first_of("?#")));
  if (url.ends_with("/layer.json")) url.resize(url.size() - 11);
  while (url.size() > 1 && url.ends_with('/')) url.pop_back();
  return url;
}

/// http://HOST:PORT of a URL.
std::string_view server_of(std::string_view url) {
  return url.substr(0, url.find_first_of("/?#", url.find("//") + 2));
}

void replace(std::string& text, std::string_view what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
}

/// The first template of layer.json, with the version in its place; empty where there is none.
std::string template_in(const Bytes& layer) {
  const auto json = json::parse<nlohmann::json>(layer);
  if (!json.is_object()) return {};
  const auto tiles = json.find("tiles"), version = json.find("version");
  if (tiles == json.end() || !tiles->is_array() || tiles->empty() || !(*tiles)[0].is_string())
    return {};
  std::string text = (*tiles)[0];
  const bool named = version != json.end() && version->is_string();
  replace(text, "{version}", named ? version->get<std::string>() : "");
  return text;
}

class UrlStore : public TileStore {
 public:
  UrlStore(const std::string& url, const UrlReader& reader, const std::string& key)
      : base_(without_layer(url)), reader_(reader), key_(key) {}

  std::string name() const override { return base_; }
  std::string layer_name() const override { return file("layer.json"); }
  std::string tile_name(TileId id) const override {
    std::string url = layer().tiles;
    if (url.empty()) return file(id.text() + ".terrain");
    replace(url, "{z}", std::to_string(id.level));
    replace(url, "{x}", std::to_string(id.x));
    replace(url, "{y}", std::to_string(id.y));
    if (is_url(url)) return url;
    if (url.starts_with('/')) return std::string(server_of(base_)) + url;
    return file(url);
  }
  bool remote() const override { return true; }

  Result<Bytes> layer_json() const override { return layer().bytes; }
  /// Servers that have none answer with anything: 404, 403, 400, a page.
  Result<std::optional<BuildRecord>> record() const override {
    const auto bytes = fetch(file("tind-build.json"));
    if (!bytes) return std::nullopt;
    return decode_build_record({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  }

  /// Where a folder is served as it is; a daemon serves none.
  Result<std::string> kept_blocks() const override {
    const auto made = record();
    if (!made || !*made) return TileStore::kept_blocks();
    const auto bytes = fetch(base_ + folder::kBlocks + (*made)->heights);
    if (!bytes) return TileStore::kept_blocks();
    std::string text(bytes->begin(), bytes->end());
    return SourceBlocks::whole(text, (*made)->heights) ? Result<std::string>(text)
                                                       : TileStore::kept_blocks();
  }

  Result<Bytes> read(TileId id) const override { return fetch(tile_name(id)); }
  Result<StoredTile> look_at(TileId id) const override {
    auto bytes = read(id);
    if (!bytes) return std::unexpected(bytes.error());
    return StoredTile{std::move(*bytes), Vouched::by_nobody};
  }

 private:
  struct Layer {
    Result<Bytes> bytes;
    std::string tiles;  // the template
  };

  const std::string base_;
  const UrlReader& reader_;
  const std::string key_;
  mutable std::once_flag asked_;
  mutable Layer layer_;

  std::string file(const std::string& file_name) const { return base_ + "/" + file_name; }

  Result<Bytes> fetch(const std::string& url) const {
    return fetch_tile(reader_, url, server_of(url) == server_of(base_) ? key_ : "");
  }

  const Layer& layer() const {
    std::call_once(asked_, [this] {
      layer_.bytes = fetch(layer_name());
      if (layer_.bytes) layer_.tiles = template_in(*layer_.bytes);
    });
    return layer_;
  }
};

}  // namespace

bool is_url(const std::string& text) {
  return text.starts_with("http://") || text.starts_with("https://");
}

std::unique_ptr<TileStore> url_store(const std::string& url, const UrlReader& reader,
                                     const std::string& key) {
  return std::make_unique<UrlStore>(url, reader, key);
}

Result<Bytes> fetch_tile(const UrlReader& reader, const std::string& url, const std::string& key) {
  // What is a field's value and no more: a line's end in it would begin another field.
  if (!std::ranges::all_of(key, [](unsigned char c) { return c > ' ' && c < 0x7f; }))
    return fail(Errc::invalid_argument, "TIND_KEY: a key is printable characters without spaces");
  return reader.read(url, kAccept, key);
}

}  // namespace tind
