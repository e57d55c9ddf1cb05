#pragma once
// The ledger of a folder of tiles: of each tile that is finished, its size and hash.
// docs/formats.md has its bytes.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/tile/layer_json.h"
#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/ledger_entry.h"

namespace tind {

inline constexpr const char* kLedgerFile = "tind-tiles.ledger";

/// Each tile that the folder may hold has its place in the file, which is empty until the tile is
/// finished; each entry has a checksum of its own. So a torn or damaged ledger says less, never
/// something wrong, and two ledgers of the same tiles are the same bytes.
class TileLedger {
 public:
  using Levels = std::vector<std::vector<proto::TileRange>>;  // as in layer.json

  /// An empty ledger's bytes and, with places for all tiles, its size. `record`: the text of the
  /// build's record, to which the ledger belongs.
  static std::string blank(std::string_view record, const Levels&);

  /// not_found, io, or bad_data where the head is damaged.
  static Result<TileLedger> open(const std::string& path);
  /// One that was read elsewhere; kept in memory. `name`: for messages. The same errors.
  static Result<TileLedger> of_bytes(std::string_view bytes, const std::string& name);

  TileLedger(TileLedger&&) noexcept;
  TileLedger& operator=(TileLedger&&) noexcept;
  ~TileLedger();

  bool belongs_to(std::string_view record) const;
  /// Stands for that record.
  std::uint64_t record() const { return seed_; }
  /// Does the folder name this tile its own, finished or not?
  bool names(TileId id) const { return place(id).has_value(); }
  const Levels& levels() const { return levels_; }
  /// Fails (bad_data) unless it names so many. `layer`: where that is said.
  Result<void> names_as_many(std::uint64_t listed, const std::string& layer) const;
  /// Does it name the same ones, in the same order?
  bool same_tiles(const TileLedger& other) const;

  /// From the file as it is now; nothing where the tile is not finished, or the entry not
  /// sound. io, where the file cannot be read. Thread-safe.
  Result<std::optional<LedgerEntry>> find(TileId) const;

  /// Where an entry goes, and its bytes. REQUIRES: names(id).
  std::uint64_t offset(TileId id) const { return *place(id); }
  std::string encode(const LedgerEntry&) const;

 private:
  TileLedger() = default;
  Result<void> read_head(const std::string& name);
  std::optional<std::uint64_t> place(TileId) const;

  int file_ = -1;
  std::uint64_t seed_ = 0, begin_ = 0;
  Levels levels_;
  std::vector<std::vector<std::uint64_t>> first_;  // by level and range: tiles before it
};

}  // namespace tind
