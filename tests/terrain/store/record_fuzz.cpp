// Any bytes as what vouches for tiles: a build's record, the seals of archives, a ledger's entry.
// What is taken is written back to the same; no bytes but those that were written vouch for a tile.

#include <string>

#include "terrain/store/build_record.h"
#include "terrain/store/ledger_entry.h"
#include "terrain/store/mbtiles/mbtiles_seal.h"
#include "terrain/store/pmtiles/pmtiles_seal.h"
#include "tests/support/fuzz_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  using test::require;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (const auto record = decode_build_record(bytes)) {
    const std::string text = encode(*record);
    const auto again = decode_build_record(text);
    require(again && encode(*again) == text, "another record when written");
    (void)may_update(*record, *again);
  }
  if (const auto seal = pmtiles::decode_seal(bytes))
    require(pmtiles::encode(*seal) == bytes, "another seal when written");
  if (const auto seal = mbtiles::decode_seal(bytes)) {
    const std::string text = mbtiles::encode(*seal);
    const auto again = mbtiles::decode_seal(text);
    require(again && mbtiles::encode(*again) == text, "another seal when written");
  }
  const TileId id{3, 5, 2};
  if (const auto entry = decode_place(bytes, id, 7)) {
    require(encode_place(*entry, 7) == bytes.substr(0, kLedgerPlace), "another entry when written");
    require(!decode_place(bytes, TileId{3, 5, 3}, 7), "an entry of two tiles");
    require(!decode_place(bytes, id, 8), "an entry of two builds");
  }
  return 0;
}
