// A DEM as a tile set: every tile made when asked for.

#include "terrain/pyramid/make/dem_tiles.h"

#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "terrain/base/caught.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/height_extremes.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/pyramid/plan/tile_version.h"
#include "terrain/store/tile_set.h"

namespace tind {

namespace {

/// How far reading is, and when it will be done if it goes on as it went.
class Reading {
 public:
  void begin() {
    const std::lock_guard lock(mutex_);
    first_.reset(), rests_ = false;
  }
  void set(double share) {
    const std::lock_guard lock(mutex_);
    share_ = share;
    // What an earlier run had read is there at once: it says nothing of how fast this one is.
    if (!first_) first_ = share, start_ = Clock::now();
  }
  /// It failed, and will be tried again after that pause.
  void rest(std::string why, std::chrono::seconds pause) {
    const std::lock_guard lock(mutex_);
    rests_ = true, why_ = std::move(why), again_ = Clock::now() + pause;
  }
  Readiness readiness() const {
    constexpr double kTooEarly = 0.005;  // to tell
    const std::lock_guard lock(mutex_);
    Readiness now{Readiness::State::reading, share_, why_};
    const double took = std::chrono::duration<double>(Clock::now() - start_).count();
    if (const double read = share_ - first_.value_or(share_); !rests_ && read > kTooEarly)
      now.seconds_left = took / read * (1 - share_);
    if (rests_)
      now.again_in_s = std::max(0.0, std::chrono::duration<double>(again_ - Clock::now()).count());
    return now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  mutable std::mutex mutex_;
  Clock::time_point start_ = Clock::now(), again_;
  double share_ = 0;
  std::optional<double> first_;  // of this run
  bool rests_ = false;
  std::string why_;  // it rested last
};

/// What may pass, as a lost connection does, a disk that is full, or a process that decodes and was
/// killed, is tried again for ever, after pauses that double.
constexpr std::chrono::seconds kFirstPause{1}, kLongestPause{300};

/// The calling thread, and those that it starts, run when nobody else wants to.
void give_way() { ::setpriority(PRIO_PROCESS, 0, 19); }  // of Linux: 0 is the thread

class TilesOnDemand : public DemTiles {
 public:
  /// `outline`: a plan whose levels and availability are right; its heights are not known yet.
  TilesOnDemand(Surface surface, TilePlan outline, std::string index_path, const std::string& name)
      : surface_(std::move(surface)),
        outline_(std::move(outline)),
        index_path_(std::move(index_path)),
        layer_(outline_.layer(name)) {
    // Of a large source all heights are not known before layer.json is asked for: its files then
    // stand for them.
    layer_.version = tile_version(surface_, outline_, "files " + surface_.info().fingerprint);
  }

  void find_heights_at_once() {
    find_heights({}, 0, true);
    known_ = true;
  }
  void find_heights_in_background() {
    reader_ = std::jthread([this](std::stop_token stop) {
      give_way();
      auto pause = kFirstPause;
      for (;; pause = std::min(2 * pause, kLongestPause)) {
        reading_.begin();
        find_heights(stop, 0, false);
        if (*plan_ || !may_pass(plan_->error())) break;
        reading_.rest(plan_->error().what, pause);
        std::mutex mutex;
        std::unique_lock lock(mutex);
        std::condition_variable_any().wait_for(lock, stop, pause, [] { return false; });
        if (stop.stop_requested()) return;
      }
      known_ = true;  // from here on others may look at plan_ and extremes_
    });
  }
  const Result<TilePlan>& plan() const { return *plan_; }

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return outline_.wanted(id); }
  Result<TileBytes> tile(TileId id, std::stop_token stop) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    if (!known_) return early_tile(id, stop);
    if (!*plan_) return std::unexpected(plan_->error());
    return make_tile(surface_, **plan_, id, stop);
  }
  std::optional<HeightExtremes> extremes() const override {
    return known_ ? extremes_ : std::nullopt;
  }
  Readiness readiness() const override {
    if (!known_) return reading_.readiness();
    if (!*plan_) return {Readiness::State::failed, reading_.readiness().share, plan_->error().what};
    return {};
  }

 private:
  /// `at_once`: nobody else knows of this object yet.
  void find_heights(std::stop_token stop, int threads, bool at_once) {
    Progress progress;
    progress.stop = stop;
    progress.report = [this](double share) { reading_.set(share); };
    std::string content;
    try {
      plan_ = plan_source(surface_, outline_.options(), index_path_, threads, progress, &content);
      if (at_once && !content.empty())  // as in a batch; later nobody may write it any more
        layer_.version = tile_version(surface_, outline_, content);
      if (*plan_) {
        if (const auto found = find_extremes(surface_, **plan_, stop)) extremes_ = *found;
      }
    } catch (const std::exception& error) {  // in a thread of its own it would end the process
      plan_ = fail("reading " + surface_.info().files.front(), caught(error));
    }
  }

  /// The same bytes as later, of what does not wait for that.
  Result<TileBytes> early_tile(TileId id, std::stop_token stop) const {
    const auto wait = fail(Errc::busy, "the heights of " + surface_.info().files.front() +
                                           " are still being read for the first time, and tile " +
                                           id.text() + " rests on all of them; try again soon");
    if (outline_.rests_on_all_heights(id)) return wait;
    auto tile = make_tile(surface_, outline_, id, std::move(stop));
    if (!tile) return tile;
    if (tile->posts > 0) seen_a_post_ = true;
    if (!seen_a_post_) return wait;
    return tile;
  }

  Surface surface_;
  TilePlan outline_;
  std::string index_path_;
  proto::LayerJson layer_;
  std::optional<Result<TilePlan>> plan_;  // written once, before known_; so are these:
  std::optional<HeightExtremes> extremes_;
  std::atomic<bool> known_ = false;
  Reading reading_;
  mutable std::atomic<bool> seen_a_post_ = false;
  std::jthread reader_;  // last: it ends before what it works on
};

}  // namespace

Result<std::unique_ptr<DemTiles>> open_dem_tiles(const Surface& surface,
                                                 const TileSetOptions& options,
                                                 std::int64_t read_at_once,
                                                 const std::string& index_path) {
  const DemInfo& info = surface.info();
  auto outline = TilePlan::make(surface, HeightRange{}, options);
  if (!outline) return std::unexpected(outline.error());
  const std::string& file = info.files.front();
  const std::string name = file.substr(file.find_last_of('/') + 1);
  auto tiles = std::make_unique<TilesOnDemand>(surface, std::move(*outline), index_path,
                                               name.substr(0, name.find('.')));
  if (surface.post_count() > read_at_once) {
    tiles->find_heights_in_background();
    return tiles;
  }
  tiles->find_heights_at_once();
  if (!tiles->plan()) return std::unexpected(tiles->plan().error());
  return tiles;
}

}  // namespace tind
