#pragma once
// How stored tiles are read: the contract of every kind of store. Bytes by address, with what the
// store knows of them; no opinion of what is in them.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/store/build_record.h"

namespace tind {

/// Does somebody vouch for a tile: are these the bytes that were written?
enum class Vouched { by_nobody, yes, not_listed, other_bytes };

/// What is known of a finished tile.
struct TileFacts {
  std::uint64_t size = 0;  // as it is stored
  double max_error_m = 0, edge_error_m = 0;
  bool not_one_sided = false;  // asked for one side, and could not be
};

struct StoredTile {
  std::vector<std::uint8_t> bytes;  // as they are stored: plain or gzipped
  Vouched vouched = Vouched::by_nobody;
  std::optional<TileFacts> facts = {};  // where the tile is vouched for
};

struct StoreListing {
  std::vector<std::vector<TileId>> levels;  // of each, sorted by (x, y); TMS rows
  std::vector<std::string> strays;          // sorted: look like tiles, and have no address of one
  std::vector<std::string>
      others;  // sorted: beside the tiles, and nothing that the store put there
};

/// Something is not as it was written that a store keeps beside its tiles.
struct StoreFault {
  enum class In { ledger, blocks };  // what vouches for tiles; what the next update goes by
  In in = In::ledger;
  std::string name, what;  // e.g. "tind-tiles.ledger", "damaged"
  bool unread = false;     // could not be read, and may be sound
};

/// Gives the tiles of one build as long as it lives: who wants those of the next one opens it anew.
/// Opening reads little or nothing; what is not there shows when it is read. Thread-safe.
class TileStore {
 public:
  virtual ~TileStore() = default;

  /// Where it is, where layer.json and a tile are: for messages.
  virtual std::string name() const = 0;
  virtual std::string layer_name() const = 0;
  virtual std::string tile_name(TileId) const = 0;
  /// Each read is a request to another machine?
  virtual bool remote() const = 0;

  /// not_found, or io; busy where it may yet come, of a build that runs there.
  virtual Result<std::vector<std::uint8_t>> layer_json() const = 0;
  /// How the tiles were made; nothing where no record, or no sound one, says. io, busy.
  virtual Result<std::optional<BuildRecord>> record() const = 0;
  /// What KeptBlocks::encode() (tile_writer.h) gave for the build of the record. not_found, io.
  virtual Result<std::string> kept_blocks() const {
    return fail(Errc::not_found, name() + " keeps no hashes of blocks");
  }

  /// A tile's bytes, as they are stored: those that were written, where somebody vouches for them.
  /// not_found; io, also where they are others; busy where the store has got tiles of another build
  /// since it was opened, or is about to.
  virtual Result<std::vector<std::uint8_t>> read(TileId) const = 0;
  /// What lies in the tile's place, sound or not. not_found, or io; busy as read().
  virtual Result<StoredTile> look_at(TileId) const = 0;
  /// How many bytes are stored; nothing where there is no such tile, or reading it alone tells. io,
  /// where it cannot be looked at.
  virtual Result<std::optional<std::uint64_t>> size(TileId) const { return std::nullopt; }
  /// What lies there, whatever layer.json says; nothing where that cannot be told. Fails where one
  /// cannot look.
  virtual Result<std::optional<StoreListing>> list() const { return std::nullopt; }

  /// Stands for the build whose tiles this gives: another number, other tiles. Nothing where no
  /// sound ledger says so.
  virtual std::optional<std::uint64_t> generation() const { return {}; }
  /// Fails where what should vouch for the tiles is damaged: read() would give what nobody knows.
  virtual Result<void> vouched_for() const { return {}; }
  /// Fails (bad_data) where that names more or fewer tiles than the `listed` ones of layer.json:
  /// one of the two is not as it was written, and who goes by the list loses tiles. busy as read().
  virtual Result<void> names_as_many(std::uint64_t /*listed*/) const { return {}; }
  /// Looks at what is kept beside the tiles.
  virtual std::vector<StoreFault> faults() const { return {}; }
};

/// What record() gives where the record, or what it stands in, could not be had: nothing, unless
/// one may be there that could not be read.
inline Result<std::optional<BuildRecord>> without_record(const Error& why) {
  if (why.code == Errc::io || why.code == Errc::busy) return std::unexpected(why);
  return std::nullopt;
}

/// Nothing that is stored is larger.
inline constexpr std::size_t kLargestStored = 64u << 20;

/// Unpacks gzip data in place; what is not gzip stays. False when the data are damaged.
bool gunzip(std::vector<std::uint8_t>& bytes);

}  // namespace tind
