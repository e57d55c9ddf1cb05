// A catalog that changes while it is asked: every answer is of one dataset as it was at some moment
// of the request, and none is refused because of a reload.

#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <future>
#include <mutex>
#include <random>
#include <thread>

#include "terrain/raster/sandboxed_pool.h"
#include "tests/server/api/api_fixture.h"
#include "tests/support/flat_dem.h"

namespace tind::api {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// How many reloads; the environment may want more.
int reloads() {
  const char* const wanted = std::getenv("RELOADS_TESTED");
  return wanted ? std::atoi(wanted) : 20;
}

class ApiReload : public Api {
 protected:
  ApiReload() { spdlog::set_level(spdlog::level::off); }
  ~ApiReload() override {
    thread_ = {};
    spdlog::set_level(spdlog::level::info);
  }

  /// The keeper runs with this configuration.
  void start(const std::string& toml, std::shared_ptr<SourcePool> pool = SourcePool::make({})) {
    write_config(toml);
    keeper_.emplace(catalog_,
                    services::CatalogKeeper::Settings{
                        .read =
                            [file = config_] {
                              return services::read_config(
                                  {.file = file, .environment = {}, .flags = {}, .datasets = {}});
                            },
                        .environment = environment_,
                        .pool = std::move(pool)});
    const auto loaded = keeper_->load();
    ASSERT_TRUE(loaded) << loaded.error()[0].what;
    app_.keeper = &*keeper_;
    thread_ = std::jthread([this](const std::stop_token& stop) { keeper_->run(stop); });
  }
  void write_config(const std::string& toml) { std::ofstream(config_) << toml; }
  Result<services::CatalogChange> reload() {
    std::promise<Result<services::CatalogChange>> promise;
    keeper_->reload([&](Result<services::CatalogChange> change) { promise.set_value(change); });
    return promise.get_future().get();
  }
  std::string in_folder(const std::string& name) const { return files_.file(name); }
  /// Of levels 11 and 12, wholly inside the DEM: what lies outside is no height of it.
  static std::string a_tile(const std::string& dataset, std::mt19937& random) {
    static const std::vector<TileId> inside = [] {
      std::vector<TileId> ids;
      for (const int level : {11, 12}) {
        const double side = 180.0 / (1 << level);
        const auto first = [&](double from) { return std::uint32_t(std::ceil(from / side)); };
        for (std::uint32_t x = first(190); (x + 1) * side < 190.199; ++x)
          for (std::uint32_t y = first(136); (y + 1) * side < 136.199; ++y)
            ids.push_back({level, x, y});
      }
      return ids;
    }();
    const TileId id = inside.at(random() % inside.size());
    return fmt::format("/terrain/{}/{}/{}/{}.terrain", dataset, id.level, id.x, id.y);
  }

  test::TempDir files_;
  const std::string config_ = files_.file("tind.toml");
  std::optional<services::CatalogKeeper> keeper_;
  std::jthread thread_;
};

std::string table(const std::string& name, const std::string& file) {
  return fmt::format("[[dataset]]\nname = \"{}\"\nfiles = [\"{}\"]\n", name, file);
}

/// What clients saw.
struct Seen {
  std::atomic<int> answers = 0, failed = 0, of_another_time = 0, mixed = 0;
  std::mutex mutex;
  std::map<std::string, std::string> by_etag;  // resource and ETag

  void check_etag(const std::string& resource, const HttpReply& reply) {
    const std::lock_guard lock(mutex);
    const auto [known, is_new] = by_etag.emplace(resource + reply.headers.at("etag"), reply.body);
    if (!is_new && known->second != reply.body) ++mixed;
  }
};

TEST_F(ApiReload, UnderLoadNothingFailsAndNothingIsMixed) {
  const int wanted = reloads();
  for (int version = 0; version <= wanted; ++version)
    test::write_flat_dem(in_folder(fmt::format("v{}.asc", version)), version);
  test::write_flat_dem(in_folder("still.asc"), 5000);
  const std::string still = table("still", "still.asc");
  ASSERT_NO_FATAL_FAILURE(start(still + table("dem", "v0.asc")));
  const auto kept = catalog_.find("still");
  const std::uint16_t at = port();

  // Version by version: what a reload has brought is what all who ask after it get.
  std::atomic<int> begun = 0, done = 0;
  std::atomic<bool> end = false;
  Seen seen;
  const auto ask = [&](unsigned seed) {
    std::mt19937 random(seed);
    HttpClient client(at);
    while (!end) {
      const bool moves = random() % 4 != 0;
      const std::string target = a_tile(moves ? "dem" : "still", random);
      const int first = done;
      const HttpReply reply = client.get(target);
      const int last = begun;
      ++seen.answers;
      if (reply.status != 200) {
        ++seen.failed;
        continue;
      }
      const auto height = test::flat_height(reply.body);
      if (!height)
        ++seen.mixed;
      else if (moves ? *height < first || *height > last : *height != 5000)
        ++seen.of_another_time;
      seen.check_etag(target, reply);
    }
  };
  int refused = 0;
  {
    std::vector<std::jthread> clients;
    for (unsigned i = 0; i < 3; ++i) clients.emplace_back(ask, i);
    const std::vector<std::string> broken = {
        "[[dataset]]\nname = \"dem\"\nfiles = [", table("dem", "nothing.asc"),
        still + table("dem", "v0.asc") + "max_eror = 1\n", "", still + table("dem", "no*.asc")};
    int version = 0;
    for (int i = 0; i < wanted; ++i) {
      if (i % 2 == 1) {
        write_config(broken[std::size_t(i / 2) % broken.size()]);
        refused += !reload().has_value();
        continue;
      }
      begun = ++version;
      write_config(still + table("dem", fmt::format("v{}.asc", version)));
      const auto change = reload();
      ASSERT_TRUE(change) << change.error().what;
      EXPECT_EQ(change->kept, 1u);
      EXPECT_EQ(change->replaced, std::vector<std::string>{"dem"});
      done = version;
      const int before = seen.answers;
      while (seen.answers < before + 10) std::this_thread::yield();
    }
    end = true;
  }
  EXPECT_EQ(refused, wanted / 2);
  EXPECT_EQ(seen.failed, 0);
  EXPECT_EQ(seen.mixed, 0);
  EXPECT_EQ(seen.of_another_time, 0);
  EXPECT_EQ(catalog_.find("still"), kept);
  EXPECT_GT(seen.by_etag.size(), std::size_t(wanted) / 2);
  RecordProperty("answers", seen.answers);
  std::printf("%d reloads, %d of them broken; %d answers, %d failed, %d mixed, %d old or early\n",
              wanted, refused, seen.answers.load(), seen.failed.load(), seen.mixed.load(),
              seen.of_another_time.load());
}

TEST_F(ApiReload, AFileOfAFolderIsReplacedWithoutAMixture) {
  fs::create_directory(in_folder("all"));
  const std::string path = in_folder("all/dem.asc");
  test::write_flat_dem(path, 1);
  const auto long_ago = fs::file_time_type::clock::now() - 1h;
  for (const auto& file : fs::directory_iterator(in_folder("all")))
    fs::last_write_time(file, long_ago);
  ASSERT_NO_FATAL_FAILURE(start("catalog = \"" + in_folder("all") + "\"\n"));
  ASSERT_TRUE(catalog_.find("dem"));
  const std::uint16_t at = port();
  std::atomic<int> of_old = 0, of_new = 0, refused = 0, wrong = 0;
  std::atomic<bool> replaced = false;
  const auto ask = [&](unsigned seed) {
    std::mt19937 random(seed);
    bool is_new = false;
    const auto until = std::chrono::steady_clock::now() + 60s;
    while (of_new < 50 && std::chrono::steady_clock::now() < until) {
      const HttpReply reply = HttpClient(at).get(a_tile("dem", random));
      const auto height = reply.status == 200 ? test::flat_height(reply.body) : std::nullopt;
      if (reply.status == 503) {
        ++refused;
        if (!replaced || is_new || !reply.headers.contains("retry-after")) ++wrong;
      } else if (height == 2 && replaced) {
        is_new = true;
        ++of_new;
      } else if (height == 1 && !is_new) {
        ++of_old;
      } else {
        ++wrong;
      }
    }
  };
  {
    std::vector<std::jthread> clients;
    for (unsigned i = 0; i < 2; ++i) clients.emplace_back(ask, i);
    while (of_old < 20) std::this_thread::yield();
    replaced = true;
    test::write_flat_dem(path, 2);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(of_new, 50);
}

TEST_F(ApiReload, ReadinessSaysWhatBecameOfFilesAndReloads) {
  test::write_flat_dem(in_folder("a.asc"), 1);
  ASSERT_NO_FATAL_FAILURE(start(table("a", "a.asc")));
  const http::Router admin = make_admin_router(app_, false);
  const std::uint16_t main_port = port();
  test::RunningServer admin_server(admin);
  const auto ask = [&](const std::string& target) {
    return HttpClient(admin_server.port()).get(target);
  };
  EXPECT_EQ(get("/readyz").body, "ready\n");
  EXPECT_EQ(ask("/readyz?verbose").body, "[+] listening\n[+] 1 datasets\nready\n");

  write_config("nonsense = 1\n");
  EXPECT_FALSE(reload());
  const std::string broken = ask("/readyz?verbose").body;
  EXPECT_NE(broken.find("tind.toml:1: unknown key nonsense"), std::string::npos) << broken;
  EXPECT_EQ(ask("/readyz").status, 200);
  // Everybody may know that, but not the names of files.
  const std::string for_all = get("/readyz?verbose").body;
  EXPECT_NE(for_all.find("[-] reload at "), std::string::npos) << for_all;
  EXPECT_EQ(for_all.find("toml"), std::string::npos) << for_all;

  write_config(table("a", "a.asc"));
  ASSERT_TRUE(reload());
  fs::rename(in_folder("a.asc"), in_folder("b.asc"));
  std::string gone;
  for (int i = 0; i < 100 && gone.find("[-] dataset a") == gone.npos; ++i) {
    std::this_thread::sleep_for(100ms);
    gone = ask("/readyz?verbose").body;
  }
  EXPECT_NE(gone.find("[-] dataset a: its files are not as they were opened: "), std::string::npos)
      << gone;
  EXPECT_NE(gone.find("a.asc: is no longer there"), std::string::npos) << gone;
  const std::string metrics = HttpClient(main_port).get("/metrics").body;
  EXPECT_NE(metrics.find("tind_datasets_changed 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("tind_reloads_total{result=\"failed\"} 1\n"), std::string::npos);
}

TEST_F(ApiReload, ReadinessSaysWhatOfTheCatalogWaitsForAnotherTry) {
  fs::create_directories(in_folder("all"));
  test::write_flat_dem(in_folder("all/a.asc"), 1);
  std::ofstream(in_folder("all/words.asc")) << "no raster";
  for (const char* name : {"all/a.asc", "all/a.prj", "all/words.asc"})
    fs::last_write_time(in_folder(name), fs::file_time_type::clock::now() - 1h);
  // Its decoders are killed as soon as they begin.
  ASSERT_NO_FATAL_FAILURE(
      start("catalog = \"" + in_folder("all") + "\"\n",
            sandboxed_pool({}, {.command = {"/bin/sh", "-c", "kill -KILL $$"}, .nursery = {}})));
  const http::Router admin = make_admin_router(app_, false);
  const std::string for_all = get("/readyz?verbose").body;
  test::RunningServer admin_server(admin);
  const std::string report = HttpClient(admin_server.port()).get("/readyz?verbose").body;
  for (const char* name : {"all/a.asc", "all/words.asc"})
    EXPECT_NE(report.find("[-] left alone: " + in_folder(name)), std::string::npos) << report;
  EXPECT_NE(for_all.find("[-] 2 datasets of the catalog cannot be opened just now"),
            std::string::npos)
      << for_all;
  EXPECT_EQ(for_all.find("asc"), std::string::npos) << for_all;
  EXPECT_EQ(get("/readyz").status, 200);
}

TEST_F(ApiReload, IsForTheOperatorAlone) {
  test::write_flat_dem(in_folder("a.asc"), 1);
  ASSERT_NO_FATAL_FAILURE(start(table("a", "a.asc")));
  const http::Router admin = make_admin_router(app_, true);
  const std::uint16_t main_port = port();
  test::RunningServer admin_server(admin);
  const auto post_to = [](std::uint16_t at, const std::string& fields) {
    HttpClient client(at);
    client.send("POST /admin/reload HTTP/1.1\r\n" + fields + "\r\n");
    return client.receive();
  };
  EXPECT_EQ(post_to(main_port, "Host: h\r\n").status, 404);
  test::write_flat_dem(in_folder("b.asc"), 1);
  write_config(table("b", "b.asc") + "[[dataset]]\nfiles = [\"a.asc\"]\n");
  const HttpReply reply = post_to(admin_server.port(), "Host: 127.0.0.1:81\r\n");
  EXPECT_EQ(reply.status, 200);
  const Json json = Json::parse(reply.body);
  EXPECT_EQ(json["kept"], 1);
  EXPECT_EQ(json["new"], Json::array({"b"}));
  EXPECT_EQ(Json::parse(get("/datasets").body)["datasets"].size(), 2u);
  write_config(table("c", "c.asc"));
  const HttpReply refused =
      post_to(admin_server.port(), "Host: localhost\r\nContent-Length: 0\r\n");
  EXPECT_EQ(refused.status, 422);
  EXPECT_NE(refused.body.find("c.asc"), std::string::npos) << refused.body;
  EXPECT_EQ(post_to(admin_server.port(), "Host: localhost\r\nOrigin: http://a.example\r\n").status,
            403);
  EXPECT_EQ(post_to(admin_server.port(), "Host: a.example:81\r\n").status, 403);
  HttpClient client(admin_server.port());
  client.send("GET /datasets HTTP/1.1\r\nHost: [::1]:81\r\n\r\n");
  EXPECT_EQ(client.receive().status, 404);
}

TEST_F(ApiReload, WhoAsksAtOnceIsAnsweredAllTheSame) {
  test::write_flat_dem(in_folder("a.asc"), 1);
  ASSERT_NO_FATAL_FAILURE(start(table("a", "a.asc")));
  std::atomic<int> answered = 0;
  for (int i = 0; i < 1000; ++i) {
    keeper_->reload();
    keeper_->reload(
        [&](Result<services::CatalogChange> change) { answered += change.has_value(); });
  }
  while (answered < 1000) std::this_thread::yield();
  EXPECT_LT(keeper_->status().reloads, 1000u);
  thread_ = {};
  Errc code = Errc::internal;
  keeper_->reload([&](Result<services::CatalogChange> change) { code = change.error().code; });
  EXPECT_EQ(code, Errc::cancelled);
}

}  // namespace
}  // namespace tind::api
