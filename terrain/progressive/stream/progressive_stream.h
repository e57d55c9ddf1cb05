#pragma once
// Progressive meshes as .tpm streams (proto/stream/mesh_stream.h), and back.

#include <cstdint>
#include <span>
#include <vector>

#include "proto/stream/mesh_stream.h"
#include "terrain/base/result.h"
#include "terrain/progressive/stream/progressive_mesh.h"
#include "terrain/progressive/stream/space_lattice.h"
#include "terrain/raster/dem_source.h"
#include "terrain/simplify/common/options.h"

namespace tind {

/// A block of a stream ends where the error has fallen to this share of what it is at its
/// beginning: by a tenth.
inline constexpr double kBlockShare = 0.9;
/// For meshes that went down a ladder of bounds (make_progressive): each rung is a block, so that
/// who asks for a rung gets the state that was made for it.
inline constexpr double kRungShare = 0.945;

/// The stream of a mesh whose positions all lie on `lattice`, which needs a step of height.
/// Splits are put into the stream's order: blocks within which the error falls to `block_share` at
/// least; inside a block in generations that do not touch each other. Every state of the new order
/// is a valid mesh, and its bound is that of its block. Fails (invalid_argument) when a position is
/// off the lattice. `info` gives place and datum.
Result<proto::MeshStream> to_stream(const ProgressiveMesh&, const Lattice& lattice,
                                    const DemInfo& info, double block_share = kBlockShare);

/// The same for a surface in space: positions on `lattice`, no DEM.
Result<proto::MeshStream> to_stream(const ProgressiveMesh&, const SpaceLattice& lattice);

/// What a stream, or a prefix of one, holds. error_m of each split is its block's; fine_error_m is
/// the bound of the state after the last split that is there.
ProgressiveMesh from_stream(const proto::MeshStream&);

/// The georeference that a stream of a terrain carries: affine, CRS, unit, datum, size. No file,
/// no fingerprint.
DemInfo info_of(const proto::MeshStream&);

}  // namespace tind
