// A server's tiles, with a server that is a list of files.

#include "terrain/store/url/url_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <mutex>

namespace tind {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using Files = std::map<std::string, std::string>;

class MadeUpServer : public UrlReader {
 public:
  explicit MadeUpServer(Files files) : files_(std::move(files)) {}

  Result<std::vector<std::uint8_t>> read(const std::string& url, const std::string& accept,
                                         const std::string& key) const override {
    asked.push_back(url);
    with_key[url] = key;
    accepted = accept;
    const auto file = files_.find(url);
    if (file == files_.end()) return fail(Errc::not_found, url + ": HTTP error code : 404");
    return std::vector<std::uint8_t>(file->second.begin(), file->second.end());
  }

  mutable std::vector<std::string> asked;
  mutable std::string accepted;
  mutable std::map<std::string, std::string> with_key;

 private:
  Files files_;
};

std::string layer_with(const std::string& tiles) { return R"({"tiles": [")" + tiles + R"("]})"; }

TEST(UrlStore, AKeyGoesToItsOwnServerAlone) {
  const std::string own = "http://a.b:80/c/3/7/2",
                    elsewhere[] = {"https://a.b:80/3/7/2", "http://a.b/3/7/2", "http://a.b.c/3/7/2",
                                   "http://a.b:80@d.e/3/7/2"};
  for (const std::string& url : {own, elsewhere[0], elsewhere[1], elsewhere[2], elsewhere[3]}) {
    const std::string where = url.substr(0, url.size() - 5) + "{z}/{x}/{y}";
    const MadeUpServer server(
        Files{{"http://a.b:80/c/layer.json", layer_with(where)}, {url, "tile"}});
    EXPECT_TRUE(url_store("http://a.b:80/c", server, "tind_k")->read({3, 7, 2})) << url;
    EXPECT_EQ(server.with_key["http://a.b:80/c/layer.json"], "tind_k");
    EXPECT_EQ(server.with_key[url], url == own ? "tind_k" : "") << url;
  }
}

TEST(UrlStore, AKeyThatWouldBeginAnotherFieldIsRefused) {
  const MadeUpServer server(Files{{"http://a.b/c", "tile"}});
  for (const char* key : {"a b", "a\r\nX: y", "a\n", "\x7f", "k\xc3\xa9"})
    EXPECT_EQ(fetch_tile(server, "http://a.b/c", key).error().code, Errc::invalid_argument) << key;
  EXPECT_TRUE(fetch_tile(server, "http://a.b/c", "tind_0aZ-._~+/="));
  EXPECT_EQ(server.asked.size(), 1u);
}

TEST(UrlStore, TilesAreWhereTheTemplateSays) {
  const std::pair<std::string, std::string> cases[] = {
      {"{z}/{x}/{y}.terrain", "http://a.b/c/3/7/2.terrain"},
      {"{z}/{x}/{y}.terrain?v={version}", "http://a.b/c/3/7/2.terrain?v=1.2.3"},
      {"/other/{y}/{x}/{z}", "http://a.b/other/2/7/3"},
      {"https://d.e/{z}-{x}-{y}", "https://d.e/3-7-2"},
  };
  for (const auto& [text, wanted] : cases) {
    const MadeUpServer server(
        {{"http://a.b/c/layer.json", R"({"version": "1.2.3", "tiles": [")" + text + R"("]})"},
         {wanted, "a tile"}});
    const auto store = url_store("http://a.b/c/", server);
    EXPECT_EQ(store->tile_name({3, 7, 2}), wanted);
    const auto tile = store->look_at({3, 7, 2});
    ASSERT_TRUE(tile) << tile.error().what;
    EXPECT_EQ(std::string(tile->bytes.begin(), tile->bytes.end()), "a tile");
    EXPECT_EQ(tile->vouched, Vouched::by_nobody);
    EXPECT_THAT(server.accepted, HasSubstr("extensions=octvertexnormals"));
  }
}

TEST(UrlStore, ALayerThatSaysNothingOfTilesLeavesThemInTheUsualPlace) {
  for (const char* layer : {"", "[]", "{}", R"({"tiles": []})", R"({"tiles": [7]})"}) {
    const MadeUpServer server(Files{{"http://a.b/layer.json", layer}});
    EXPECT_EQ(url_store("http://a.b", server)->tile_name({0, 1, 0}), "http://a.b/0/1/0.terrain");
  }
  const MadeUpServer nothing(Files{});
  const auto store = url_store("http://a.b/c", nothing);
  EXPECT_EQ(store->tile_name({0, 1, 0}), "http://a.b/c/0/1/0.terrain");
  EXPECT_EQ(store->layer_json().error().code, Errc::not_found);
  EXPECT_EQ(store->read({0, 1, 0}).error().code, Errc::not_found);
  EXPECT_FALSE(*store->record());
}

TEST(UrlStore, NamesOfTheLayerNameTheSet) {
  const MadeUpServer server(Files{});
  for (const char* name : {"https://a.b/c", "https://a.b/c//", "https://a.b/c/layer.json",
                           "https://a.b/c/layer.json?key=1#x"}) {
    const auto store = url_store(name, server);
    EXPECT_EQ(store->name(), "https://a.b/c");
    EXPECT_EQ(store->layer_name(), "https://a.b/c/layer.json");
  }
}

TEST(UrlStore, TheLayerIsAskedForOnceAndNotBeforeItIsNeeded) {
  const MadeUpServer server(Files{{"http://a.b/layer.json", layer_with("{z}/{x}/{y}")}});
  const auto store = url_store("http://a.b", server);
  EXPECT_THAT(server.asked, ElementsAre());
  ASSERT_TRUE(store->layer_json());
  ASSERT_TRUE(store->layer_json());
  EXPECT_FALSE(store->read({1, 2, 0}));
  EXPECT_THAT(server.asked, ElementsAre("http://a.b/layer.json", "http://a.b/1/2/0"));
}

TEST(UrlStore, NothingIsKnownOfTilesThatWereNotAskedFor) {
  const MadeUpServer server(Files{});
  const auto store = url_store("http://a.b", server);
  const auto listed = store->list();
  ASSERT_TRUE(listed);
  EXPECT_FALSE(*listed);
  EXPECT_FALSE(store->size({0, 0, 0}).value());
  EXPECT_FALSE(store->generation());
  EXPECT_TRUE(store->remote());
}

TEST(UrlStore, ARecordBesideTheTilesIsRead) {
  BuildRecord made;
  made.max_error_m = 2.5;
  const MadeUpServer server(Files{{"http://a.b/tind-build.json", encode(made)}});
  const auto record = url_store("http://a.b", server)->record();
  ASSERT_TRUE(record && *record);
  EXPECT_EQ((*record)->max_error_m, 2.5);
}

}  // namespace
}  // namespace tind
