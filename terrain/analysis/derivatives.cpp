// [HORN81] B.K.P. Horn: Hill shading and the reflectance map. Proceedings of the IEEE 69, 1981.
// [RIL99]  S. Riley, S. DeGloria, R. Elliot: A terrain ruggedness index that quantifies topographic
//          heterogeneity. Intermountain Journal of Sciences 5, 1999.
// [WIL07]  M. Wilson et al.: Multiscale terrain analysis of multibeam bathymetry data for habitat
//          mapping on the continental slope. Marine Geodesy 30, 2007.

#include "terrain/analysis/derivatives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "terrain/geo/ellipsoid.h"
#include "terrain/raster/crs_axes.h"

namespace tind {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

/// A post in the middle (4) and its neighbours, row by row from the north-west.
using Nine = std::array<double, 9>;

/// From differences along columns and rows to the rise to the east and north, on the ground.
class Ground {
 public:
  /// `axes`: of the DEM's CRS, which may count to the west, or to the south.
  Ground(const DemInfo& info, const CrsAxes& axes)
      : map_(axes.east_north(info.post_to_crs)), geographic_(info.crs_kind == CrsKind::geographic) {
    x_m_ = y_m_ = info.crs_unit_m;
    if (!geographic_) return;
    const double step = std::hypot(map_.x_col, map_.y_col);
    degrees_ = info.period_cols > 0 && step > 0 ? 360 / (info.period_cols * step) : 1;
  }

  /// Do distances change along a row, too?
  bool turned() const { return geographic_ && map_.y_col != 0; }
  double latitude(std::int64_t row) const { return map_.apply(0, double(row)).y * degrees_; }
  double longitude(std::int64_t col) const { return map_.apply(double(col), 0).x * degrees_; }
  bool at_pole(std::int64_t row) const {
    const double step = std::abs(map_.y_row) * degrees_;
    return geographic_ && !turned() && std::abs(latitude(row)) > 90 - step / 4;
  }
  /// Distances as they are there.
  void move_to(std::int64_t col, std::int64_t row) {
    if (geographic_) {
      const double lat = map_.apply(double(col), double(row)).y * degrees_;
      // At a pole, columns have no distance: those a metre's part away have.
      const Vec2 metres = wgs84::metres_per_degree(std::clamp(lat, -89.99999, 89.99999));
      x_m_ = metres.x * degrees_, y_m_ = metres.y * degrees_;
    }
    const Affine& a = map_;
    along_col_ = {a.x_col * x_m_, a.y_col * y_m_};
    along_row_ = {a.x_row * x_m_, a.y_row * y_m_};
    area_ = along_col_.x * along_row_.y - along_row_.x * along_col_.y;
  }

  /// x: to the east, y: to the north.
  Vec2 gradient(double by_col, double by_row) const {
    return {(by_col * along_row_.y - by_row * along_col_.y) / area_,
            (by_row * along_col_.x - by_col * along_row_.x) / area_};
  }

 private:
  const Affine map_;  // to east and north
  const bool geographic_;
  double degrees_ = 1, x_m_ = 1, y_m_ = 1;
  Vec2 along_col_{}, along_row_{};
  double area_ = 1;
};

/// A corner of the nine, and the two sides beside it.
struct Corner {
  std::size_t at, beside, other;
};
constexpr Corner kCorners[] = {{0, 1, 3}, {2, 1, 5}, {6, 7, 3}, {8, 7, 5}};

/// Those that are not there are put where the others lead, so that a plane stays one: the line
/// through the opposite side, the plane of a corner and what is beside it, and at last the post.
void complete(Nine& z) {
  const double post = z[4];
  const auto missing = [&](std::size_t k) { return std::isnan(z[k]); };
  const auto by_opposites = [&] {
    for (const std::size_t k : {1, 3, 5, 7})
      if (missing(k) && !missing(8 - k)) z[k] = 2 * post - z[8 - k];
  };
  by_opposites();
  for (const Corner& c : kCorners) {
    if (missing(c.at)) continue;
    if (missing(c.beside) && !missing(c.other)) z[c.beside] = z[c.at] - z[c.other] + post;
    if (missing(c.other) && !missing(c.beside)) z[c.other] = z[c.at] - z[c.beside] + post;
  }
  by_opposites();
  for (const std::size_t k : {1, 3, 5, 7})
    if (missing(k)) z[k] = post;
  const Nine there = z;  // a corner that is put somewhere does not lead its opposite
  for (const Corner& c : kCorners)
    if (missing(c.at))
      z[c.at] = std::isnan(there[8 - c.at]) ? z[c.beside] + z[c.other] - post
                                            : 2 * post - there[8 - c.at];
}

Vec2 horn(const Nine& z, const Ground& ground) {
  const double by_col = ((z[2] + 2 * z[5] + z[8]) - (z[0] + 2 * z[3] + z[6])) / 8;
  const double by_row = ((z[6] + 2 * z[7] + z[8]) - (z[0] + 2 * z[1] + z[2])) / 8;
  return ground.gradient(by_col, by_row);
}

bool takes_a_gradient(Derivative kind) {
  return kind == Derivative::slope || kind == Derivative::aspect || kind == Derivative::hillshade;
}

/// At a pole all columns are one point, so there are no differences along its row: the plane
/// through it that fits the posts of the next row best, which lie around it. Posts have one column
/// more on each side.
class Pole {
 public:
  /// REQUIRES: `row` is at a pole.
  Pole(const Ground& ground, const HeightGrid& posts, int read_row, std::int64_t row)
      : ground_(ground), posts_(posts), read_row_(read_row) {
    north_ = ground_.latitude(row) > 0;
    inner_ = std::abs(ground_.latitude(row + 1)) < std::abs(ground_.latitude(row)) ? 1 : -1;
    const double lat = (ground_.latitude(row) + ground_.latitude(row + inner_)) / 2;
    const double step = std::abs(ground_.latitude(row + inner_) - ground_.latitude(row));
    distance_m_ = wgs84::metres_per_degree(lat).y * step;
    ground_.move_to(0, row + inner_);
    for (int c = 1; c + 1 < posts.cols(); ++c) {
      if (posts.is_void(c, read_row_ + inner_)) continue;
      const Vec2 u = toward(c);
      const double z = posts.at(c, read_row_ + inner_);
      sum_.x += u.x, sum_.y += u.y, rise_.x += u.x * z, rise_.y += u.y * z;
      xx_ += u.x * u.x, xy_ += u.x * u.y, yy_ += u.y * u.y, ++count_;
    }
  }

  /// x: to the east, y: to the north, for one who came along the meridian of the column.
  Vec2 gradient(int read_col, const Nine& z) const {
    const double det = xx_ * yy_ - xy_ * xy_;
    if (det < 0.01 * count_ * count_) {  // posts of one side: of a full circle it is n^2 / 4
      const auto side = std::size_t(inner_ > 0 ? 7 : 1);
      return ground_.gradient((z[side + 1] - z[side - 1]) / 2, inner_ * (z[side] - z[4]));
    }
    const double post = posts_.at(read_col, read_row_);
    const Vec2 b{rise_.x - post * sum_.x, rise_.y - post * sum_.y}, u = toward(read_col);
    const Vec2 g{(b.x * yy_ - b.y * xy_) / det / distance_m_,
                 (b.y * xx_ - b.x * xy_) / det / distance_m_};
    const double away = g.x * u.x + g.y * u.y;
    return {g.y * u.x - g.x * u.y, north_ ? -away : away};
  }

 private:
  Vec2 toward(int read_col) const {
    const double lon = ground_.longitude(read_col - 1) * 3.14159265358979323846 / 180;
    return {std::cos(lon), std::sin(lon)};
  }

  Ground ground_;  // of the next row
  const HeightGrid& posts_;
  int read_row_, inner_ = 1;
  bool north_ = true;
  double distance_m_ = 1;
  Vec2 sum_{}, rise_{};
  double xx_ = 0, xy_ = 0, yy_ = 0, count_ = 0;
};

/// `g`: of those that take one.
float value_of(const Nine& z, const Vec2& g, const DerivativeOptions& options) {
  switch (options.kind) {
    case Derivative::slope:
      return float(options.percent ? 100 * std::hypot(g.x, g.y) : slope_deg(g.x, g.y));
    case Derivative::aspect:
      return g.x == 0 && g.y == 0 ? kNothing : float(aspect_deg(g.x, g.y));
    case Derivative::hillshade:
      return hillshade_grey(g.x, g.y, options.light);
    case Derivative::roughness: {
      const auto [low, high] = std::ranges::minmax(z);
      return float(high - low);
    }
    case Derivative::tri: {
      double sum = 0;
      for (const double v : z) sum += (v - z[4]) * (v - z[4]);
      return float(std::sqrt(sum));
    }
    case Derivative::tpi: {
      double sum = -z[4];
      for (const double v : z) sum += v;
      return float(z[4] - sum / 8);
    }
  }
  return kNothing;
}

}  // namespace

RasterRows derivative_rows(const DemSource& dem, const DerivativeOptions& options,
                           const Progress& progress) {
  return [&dem, options, progress, axes = crs_axes(dem.info().crs_wkt)](
             int row, int rows) -> Result<HeightGrid> {
    if (!axes) return std::unexpected(axes.error());
    const DemInfo& info = dem.info();
    const int cols = int(info.cols);
    if (progress.stopped()) return fail(Errc::cancelled, "stopped");
    const auto posts = dem.read(-1, row - 1, cols + 2, rows + 2);
    if (!posts) return std::unexpected(posts.error());
    HeightGrid out(cols, rows);
    Ground ground(info, *axes);
    const bool gradients = takes_a_gradient(options.kind);
    for (int r = 0; r < rows; ++r) {
      const std::int64_t at = std::int64_t(row) + r;
      ground.move_to(0, at);
      std::optional<Pole> pole;
      if (gradients && ground.at_pole(at)) pole.emplace(ground, *posts, r + 1, at);
      for (int c = 0; c < cols; ++c) {
        if (posts->is_void(c + 1, r + 1)) continue;
        if (ground.turned()) ground.move_to(c, at);
        Nine z;
        for (int k = 0; k < 9; ++k) z[std::size_t(k)] = posts->at(c + k % 3, r + k / 3);
        complete(z);
        const Vec2 g = pole ? pole->gradient(c + 1, z) : gradients ? horn(z, ground) : Vec2{};
        out.at(c, r) = value_of(z, g, options);
      }
    }
    progress.at(double(row + rows) / double(info.rows));
    return out;
  };
}

RasterContents contents_of(const DerivativeOptions& options) {
  RasterContents contents{.heights = false};
  for (const auto& [kind, name] : EnumNames<Derivative>::kAll)
    if (kind == options.kind) contents.what = name;
  switch (options.kind) {
    case Derivative::slope:
      contents.unit = options.percent ? "percent" : "degree";
      break;
    case Derivative::aspect:
      contents.unit = "degree";
      break;
    case Derivative::hillshade:
      contents.unit = "";
      contents.pixel = RasterPixel::uint8;
      break;
    default:
      break;
  }
  return contents;
}

}  // namespace tind
