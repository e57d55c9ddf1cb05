#pragma once
// A bucket of FlightGear's scenery: from the surface to the two files that fgfs reads.

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "proto/tile/btg.h"
#include "terrain/base/result.h"
#include "terrain/flightgear/bucket_plan.h"
#include "terrain/raster/land_cover.h"

namespace tind::flightgear {

/// "3056115.btg.gz" and "3056115.stg".
std::string btg_name(BucketId);
std::string stg_name(BucketId);

struct Bucket {
  std::vector<std::uint8_t> btg_gz;
  std::string stg;          // says the error, and the SHA-1 of the other
  double max_error_m = 0;   // no valid post is farther from the mesh as FlightGear reads it
  double edge_error_m = 0;  // its borders, of that of the DEM with its voids filled
  double void_share = 0;    // of its area: no height is known there, and it is filled
  std::uint64_t posts = 0, triangles = 0;
};

/// The mesh as it is written. Pure: depends on the plan and the id alone. GUARANTEES: buckets that
/// touch have the same vertices on the line between, to the last bit, once a reader has added the
/// centre. Nothing where no post of it is valid: there FlightGear has its ocean. `said`: becomes
/// what a Bucket says of it.
/// `cover`, which may be null, says what its materials are.
Result<std::optional<proto::Btg>> model_bucket(const BucketPlan&, BucketId, Bucket& said,
                                               std::stop_token = {},
                                               const LandCover* cover = nullptr);

/// THE path from a surface to a bucket: the daemon and the batch both come through here, so it has
/// the same bytes whoever asks. Thread-safe.
Result<std::optional<Bucket>> make_bucket(const BucketPlan&, BucketId, std::stop_token = {},
                                          const LandCover* cover = nullptr);

/// What an .stg of make_bucket() says; nothing where it is another's, or cut off.
struct SaidInStg {
  double max_error_m = 0;
  double void_share = 0;
  std::uint64_t posts = 0;
  std::string sha1;  // of the packed BTG
};
std::optional<SaidInStg> read_stg(const std::string&);
/// Does it lead to something, and has not what make_bucket() says before that? Not so of one that
/// is cut off.
bool is_anothers_stg(const std::string&);

}  // namespace tind::flightgear
