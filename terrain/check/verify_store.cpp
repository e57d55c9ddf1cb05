#include "terrain/check/verify_store.h"

#include <algorithm>
#include <atomic>

#include "proto/tile/layer_json.h"
#include "terrain/base/caught.h"
#include "terrain/base/parallel.h"
#include "terrain/geo/availability.h"
#include "terrain/geo/tile_order.h"
#include "terrain/store/layer_place.h"

namespace tind {

namespace {

constexpr int kRemoteThreads = 8;  // mostly waiting for answers

enum class State : std::uint8_t { unknown, sound, damaged, unread, missing, unlisted };

/// The tiles that there should be.
struct Expected {
  bool known = false;           // layer.json could be had
  std::vector<TileArea> areas;  // by level

  bool holds(TileId id) const {
    return std::size_t(id.level) < areas.size() &&
           areas[std::size_t(id.level)].contains(id.x, id.y);
  }
};

/// What layer.json says, and a fault where it says nothing that can be read.
Expected expected_of(const TileStore& store, std::vector<StoreFault>& faults) {
  Expected expected;
  const auto layer = layer_of(store);
  if (!layer) {
    const auto record = store.record();
    const bool under_way = (layer.error().code == Errc::not_found && record && *record) ||
                           layer.error().code == Errc::busy;
    faults.push_back({StoreFault::In::ledger, "layer.json",
                      under_way ? "is not there yet: the build that it comes with at last has not "
                                  "ended; wait for it, or run the same tind build again"
                                : layer.error().what,
                      may_pass(layer.error())});
    return expected;
  }
  expected.known = true;
  for (const auto& level : layer->available) expected.areas.push_back(area_of(level));
  return expected;
}

State state_of(const TileStore& store, TileId id, std::uint64_t& bytes) {
  const auto tile = store.look_at(id);
  if (!tile)
    return tile.error().code == Errc::not_found  ? State::missing
           : tile.error().code == Errc::bad_data ? State::damaged
                                                 : State::unread;
  bytes = tile->bytes.size();
  if (tile->vouched == Vouched::yes) return State::sound;
  return tile->vouched == Vouched::other_bytes ? State::damaged : State::unlisted;
}

void add(VerifyReport::Tiles& to, TileId id) {
  ++to.count;
  if (to.named.size() < VerifyReport::kNamed) to.named.push_back(id.text());
}

void count(VerifyReport& report, State state, TileId id) {
  switch (state) {
    case State::sound:
      ++report.sound;
      break;
    case State::missing:
      add(report.missing, id);
      break;
    case State::unlisted:
      add(report.unlisted, id);
      break;
    case State::unread:
      add(report.unread, id);
      break;
    case State::unknown:
    case State::damaged:
      add(report.damaged, id);
  }
}

/// All that lie in the store: where layer.json could not be had, the hashes still say something.
std::vector<TileId> listed_in(const TileStore& store) {
  std::vector<TileId> all;
  if (const auto there = store.list(); there && *there)
    for (const auto& level : (*there)->levels) all.insert(all.end(), level.begin(), level.end());
  return all;
}

/// What lies in the store and layer.json does not name.
Result<void> look_for_others(const TileStore& store, const Expected& expected,
                             VerifyReport& report) {
  auto there = store.list();
  if (!there) return std::unexpected(there.error());
  if (!*there) return {};
  for (const auto& level : (*there)->levels)
    for (const TileId id : level) {
      if (!expected.known || expected.holds(id)) continue;
      std::uint64_t bytes = 0;
      if (state_of(store, id, bytes) == State::sound)
        report.faults.push_back(
            {StoreFault::In::ledger, "layer.json", "does not name tile " + id.text()});
      else
        add(report.foreign, id);
    }
  for (const std::string& stray : (*there)->strays) {
    ++report.foreign.count;
    if (report.foreign.named.size() < VerifyReport::kNamed) report.foreign.named.push_back(stray);
  }
  report.others = std::move((*there)->others);
  return {};
}

}  // namespace

Result<VerifyReport> verify_store(const TileStore& store, int threads, const Progress& progress) {
  VerifyReport report;
  report.faults = store.faults();
  if (const auto layer = store.layer_json(); !layer && !store.generation())
    return std::unexpected(layer.error());
  if (!store.generation() && report.faults.empty())
    return fail(Errc::unsupported, store.name() +
                                       " keeps no hashes of its tiles, so nobody can say whether "
                                       "they are as they were written; tind check looks into them");
  const Expected expected = expected_of(store, report.faults);
  const TileOrder order(expected.areas, 0, int(expected.areas.size()) - 1);
  const std::vector<TileId> listed = expected.known ? std::vector<TileId>() : listed_in(store);
  const auto id_of = [&](std::size_t k) { return expected.known ? order[k] : listed[k]; };
  report.tiles = expected.known ? order.size() : listed.size();
  std::vector<State> states(report.tiles, State::unknown);
  std::atomic<std::uint64_t> bytes = 0;
  std::atomic<std::size_t> done = 0;
  if (threads == 0 && store.remote()) threads = kRemoteThreads;
  parallel_for(states.size(), threads, [&](std::size_t k) {
    if (progress.stopped()) return;
    std::uint64_t size = 0;
    states[k] = state_of(store, id_of(k), size);
    bytes += size;
    if (++done % std::max<std::size_t>(1, states.size() / 300) == 0)
      progress.at(double(done) / double(states.size()));
  });
  if (progress.stopped()) return fail(Errc::cancelled, "stopped");
  report.bytes = bytes;
  for (std::size_t k = 0; k < states.size(); ++k) count(report, states[k], id_of(k));
  if (auto looked = look_for_others(store, expected, report); !looked)
    report.faults.push_back({StoreFault::In::ledger, store.name(), looked.error().what,
                             looked.error().code == Errc::io});
  return report;
}

}  // namespace tind
