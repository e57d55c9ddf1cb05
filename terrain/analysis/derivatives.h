#pragma once
// What a DEM's neighbourhoods say: slope, aspect, hillshade, roughness; on the DEM's own grid.

#include <utility>

#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/images/shade_image.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/raster_file.h"

namespace tind {

enum class Derivative {
  slope,      // degrees from the horizontal, or per cent
  aspect,     // degrees clockwise from the grid's north that the slope faces; flat: no value
  hillshade,  // 1 (away from the light) to 255
  roughness,  // the largest difference of heights among a post and its eight neighbours [WIL07]
  tri,        // ruggedness: root of the sum of the squared differences to the eight [RIL99]
  tpi,        // position: height above the mean of the eight [WIL07]
};
template <>
struct EnumNames<Derivative> {
  static constexpr const char* kWhat = "derivative";
  static constexpr std::pair<Derivative, const char*> kAll[] = {
      {Derivative::slope, "slope"},
      {Derivative::aspect, "aspect"},
      {Derivative::hillshade, "hillshade"},
      {Derivative::roughness, "roughness"},
      {Derivative::tri, "tri"},
      {Derivative::tpi, "tpi"}};
};

struct DerivativeOptions {
  Derivative kind = Derivative::slope;
  Shade light = {};      // of hillshade
  bool percent = false;  // of slope
};

/// Gradients are Horn's [HORN81], over the eight neighbours. Distances are those on the ground: of
/// degrees as the ellipsoid has them at the row's latitude, of projected CRSs the CRS's own, which
/// may be other than the ground's (plane_scale.h); directions are those of its grid, whichever way
/// its axes count (crs_axes.h). A
/// neighbour that is void or beyond the rim is where the line through its opposite and the post
/// leads, or, where that is not there either, where the others lead; so all valid posts have a
/// value, and a plane's are the same everywhere. At a pole the plane is fitted to the row around
/// it. Where all nine are there, and the grid is projected and not turned, what gdaldem computes
/// (horn).
///
/// For encode_raster(): reads the rows asked for and one beside them. The source is to outlive it.
RasterRows derivative_rows(const DemSource&, const DerivativeOptions&, const Progress& = {});

/// What a raster of it says of itself.
RasterContents contents_of(const DerivativeOptions&);

}  // namespace tind
