// OGR gives geometries of many kinds, nested; what is left of them here are chains of points.

#include "terrain/raster/gdal/vectors/vector_source.h"

#include <cpl_string.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string_view>

#include "terrain/base/existing_file.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/base/sqlite.h"
#include "terrain/raster/gdal/crs/gdal_crs.h"
#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/gdal/vectors/vector_files.h"

namespace tind {

namespace {

using Dataset = std::unique_ptr<GDALDataset, decltype([](GDALDataset* d) { GDALClose(d); })>;
using Geometry = std::unique_ptr<OGRGeometry>;

/// From the coordinates of one layer to posts.
class ToPosts {
 public:
  static Result<ToPosts> make(OGRLayer& layer, const DemSource& dem) {
    ToPosts to(dem);
    const DemInfo& info = dem.info();
    if (info.crs_kind == CrsKind::none || !layer.GetSpatialRef()) return to;
    const auto crs = gdal::describe(layer.GetSpatialRef());
    if (!crs) return std::unexpected(crs.error());
    if (crs->vertical_unit_m > 0) to.z_unit_m_ = crs->vertical_unit_m;
    if (crs->kind == CrsKind::none || gdal::same_crs(crs->wkt, info.crs_wkt)) return to;
    to.same_ = false;
    if (crs->plain_wgs84) return to;
    OGREnvelope box;
    Vec2 where;
    if (layer.GetExtent(&box, TRUE) == OGRERR_NONE)
      where = {(box.MinX + box.MaxX) / 2, (box.MinY + box.MaxY) / 2};
    auto made = gdal::ToGeographic::make(crs->wkt, where);
    if (!made) return std::unexpected(made.error());
    to.geographic_ = std::move(*made);
    return to;
  }

  VectorLine line(const OGRSimpleCurve& curve) const {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const int n = curve.getNumPoints();
    std::vector<Vec2> places;
    places.reserve(std::size_t(n));
    for (int i = 0; i < n; ++i) places.push_back({curve.getX(i), curve.getY(i)});
    if (same_) {
      for (Vec2& p : places) p = dem_->info().post_to_crs.invert(p.x, p.y);
    } else {
      if (geographic_) geographic_->to_geographic(places);
      std::vector<Geographic> on_earth;
      on_earth.reserve(places.size());
      for (const Vec2& p : places) on_earth.push_back({p.x, p.y});
      dem_->to_post(on_earth, places);
    }
    VectorLine line;
    for (int i = 0; i < n; ++i)
      line.push_back({places[i].x, -places[i].y, curve.Is3D() ? curve.getZ(i) * z_unit_m_ : kNone});
    return line;
  }

 private:
  explicit ToPosts(const DemSource& dem) : dem_(&dem) {}

  const DemSource* dem_;
  bool same_ = true;
  double z_unit_m_ = 1;
  std::unique_ptr<gdal::ToGeographic> geographic_;  // null: longitude and latitude already
};

/// One chain without a jump where it crosses the antimeridian, or the seam of a DEM; `turn`: all
/// the way around the globe.
void unroll(VectorLine& line, double turn) {
  double turned = 0, last = line.empty() ? 0 : line.front().x;
  for (Vec3& p : line) {
    const double step = p.x - last;
    last = p.x;
    // A step of all the way around goes along the edge of the map, as to a pole: it is meant.
    if (std::abs(step) > turn / 2 && std::abs(step) < turn * (1 - 1e-9))
      turned += step > 0 ? -turn : turn;
    p.x += turned;
  }
}

/// From the coordinates of one layer to longitudes and latitudes.
class ToGlobe {
 public:
  static Result<ToGlobe> make(OGRLayer& layer, const DemInfo& dem) {
    ToGlobe to;
    auto crs = gdal::describe(layer.GetSpatialRef());
    if (!crs) return std::unexpected(crs.error());
    if (crs->vertical_unit_m > 0) to.z_unit_m_ = crs->vertical_unit_m;
    if (crs->plain_wgs84) return to;
    std::string wkt = crs->wkt;
    if (crs->kind == CrsKind::none) wkt = dem.crs_wkt;
    if (wkt.empty()) return fail(Errc::bad_data, "has no CRS, and neither has the DEM");
    OGREnvelope box;
    Vec2 where;
    if (layer.GetExtent(&box, TRUE) == OGRERR_NONE)
      where = {(box.MinX + box.MaxX) / 2, (box.MinY + box.MaxY) / 2};
    auto made = gdal::ToGeographic::make(wkt, where);
    if (!made) return std::unexpected(made.error());
    to.geographic_ = std::move(*made);
    return to;
  }

  VectorLine line(const OGRSimpleCurve& curve) const {
    VectorLine line;
    Place last;
    for (int i = 0; i < curve.getNumPoints(); ++i) {
      Place place = at({curve.getX(i), curve.getY(i)});
      place.z = curve.Is3D() ? curve.getZ(i) * z_unit_m_ : std::numeric_limits<double>::quiet_NaN();
      if (i > 0 && geographic_) divide(last, place, kDeepest, line);
      line.push_back({place.globe.x, place.globe.y, place.z});
      last = place;
    }
    unroll(line, 360);
    return line;
  }

 private:
  struct Place {
    Vec2 crs, globe;
    double z = 0;
  };
  static constexpr int kDeepest = 10;        // halvings of a segment
  static constexpr double kStraight = 1e-7;  // degrees

  ToGlobe() = default;

  Place at(Vec2 crs) const {
    Place place{crs, crs};
    if (geographic_) geographic_->to_geographic(std::span(&place.globe, 1));
    return place;
  }
  /// The points between a and b that keep the line as straight as it is in its own CRS.
  void divide(const Place& a, const Place& b, int depth, VectorLine& line) const {
    if (depth == 0) return;
    Place middle = at({(a.crs.x + b.crs.x) / 2, (a.crs.y + b.crs.y) / 2});
    middle.z = (a.z + b.z) / 2;
    const double off = std::max(std::abs(middle.globe.x - (a.globe.x + b.globe.x) / 2),
                                std::abs(middle.globe.y - (a.globe.y + b.globe.y) / 2));
    if (!(off > kStraight) || off > 90) return;  // also where a place is unknown
    divide(a, middle, depth - 1, line);
    line.push_back({middle.globe.x, middle.globe.y, middle.z});
    divide(middle, b, depth - 1, line);
  }

  double z_unit_m_ = 1;
  std::unique_ptr<gdal::ToGeographic> geographic_;  // null: longitude and latitude already
};

/// Coordinates as the file has them.
struct AsTheyAre {
  VectorLine line(const OGRSimpleCurve& curve) const {
    VectorLine line;
    for (int i = 0; i < curve.getNumPoints(); ++i)
      line.push_back({curve.getX(i), curve.getY(i),
                      curve.Is3D() ? curve.getZ(i) : std::numeric_limits<double>::quiet_NaN()});
    return line;
  }
};

template <class To>
void add(const OGRGeometry& g, const To& to, VectorShapes& out) {
  switch (wkbFlatten(g.getGeometryType())) {
    case wkbPoint:
      ++out.points;
      break;
    case wkbLineString:
    case wkbLinearRing:
      out.lines.push_back(to.line(*g.toSimpleCurve()));
      break;
    case wkbPolygon:
    case wkbTriangle: {
      VectorPolygon polygon;
      polygon.feature = out.features - 1;
      for (const OGRLinearRing* ring : *g.toPolygon()) polygon.rings.push_back(to.line(*ring));
      out.polygons.push_back(std::move(polygon));
      break;
    }
    case wkbPolyhedralSurface:
    case wkbTIN:
      for (const OGRPolygon* face : *g.toPolyhedralSurface()) add(*face, to, out);
      break;
    default:
      if (OGR_GT_IsSubClassOf(g.getGeometryType(), wkbGeometryCollection))
        for (const OGRGeometry* part : *g.toGeometryCollection()) add(*part, to, out);
  }
}

/// Goes through the features of one file, which together are bounded by its bytes: in some formats
/// one shape can be named a million times.
class Features {
 public:
  Features(GDALDataset& set, const gdal::VectorFiles& files) {
    const CPLStringList names(set.GetFileList());
    for (int i = 0; i < names.Count(); ++i) bytes_ += files.size_of(names[i]);
    if (bytes_ == 0) bytes_ = std::numeric_limits<std::uint64_t>::max() / kTimes;  // not said
    of_json_ = std::string_view(set.GetDriverName()).contains("JSON");
  }

  /// Of a kind of GeoJSON.
  bool of_json() const { return of_json_; }

  /// take(feature, its geometry with straight lines: null where it has none).
  template <class Take>
  Result<void> each(OGRLayer& layer, const Take& take) {
    for (const auto& feature : layer) {
      const OGRGeometry* g = feature->GetGeometryRef();
      const Geometry straight(g && !g->IsEmpty() ? g->getLinearGeometry() : nullptr);
      if (straight) shapes_ += straight->WkbSize();
      if (++count_ > bytes_ || shapes_ > kTimes * bytes_)
        return fail(Errc::unsupported,
                    std::string(layer.GetName()) +
                        ": more features than a file of its size can hold: does it name the "
                        "same shapes many times? store them as they are (ogr2ogr)");
      take(*feature, straight.get());
    }
    return {};
  }

 private:
  static constexpr std::uint64_t kTimes = 100;  // an arc that is named becomes as many points
  std::uint64_t bytes_ = 0, count_ = 0, shapes_ = 0;
  bool of_json_ = false;
};

/// Whether any point has one, of what is behind so many lines and polygons.
bool has_heights(const VectorShapes& shapes, std::size_t lines, std::size_t polygons) {
  const auto has = [](const VectorLine& line) {
    return std::ranges::any_of(line, [](const Vec3& p) { return std::isfinite(p.z); });
  };
  return std::ranges::any_of(std::span(shapes.lines).subspan(lines), has) ||
         std::ranges::any_of(
             std::span(shapes.polygons).subspan(polygons),
             [&](const VectorPolygon& p) { return std::ranges::any_of(p.rings, has); });
}

template <class To, class Dem>
Result<void> read_layer(OGRLayer& layer, const Dem& dem, Features& features, VectorShapes& out) {
  const auto to = To::make(layer, dem);
  if (!to) return std::unexpected(to.error());
  const std::size_t lines = out.lines.size(), polygons = out.polygons.size();
  const auto read = features.each(layer, [&](const OGRFeature&, const OGRGeometry* shape) {
    ++out.features;
    if (shape) add(*shape, *to, out);
  });
  if (!read || !has_heights(out, lines, polygons)) return read;
  const auto stated = stated_datum(layer.GetSpatialRef(), features.of_json());
  if (!stated) return std::unexpected(stated.error());
  if (*stated && std::ranges::find(out.stated, **stated) == out.stated.end())
    out.stated.push_back(**stated);
  return {};
}

/// Whether any point lies within the DEM's rectangle, or the box of a shape meets it.
bool meets(const VectorShapes& shapes, const DemInfo& dem) {
  const auto line_meets = [&](const VectorLine& line) {
    double west = INFINITY, east = -INFINITY, south = INFINITY, north = -INFINITY;
    for (const Vec3& p : line) {
      west = std::min(west, p.x), east = std::max(east, p.x);
      south = std::min(south, p.y), north = std::max(north, p.y);
    }
    return west <= double(dem.cols - 1) && east >= 0 && south <= 0 &&
           north >= -double(dem.rows - 1);
  };
  return std::ranges::any_of(shapes.lines, line_meets) ||
         std::ranges::any_of(shapes.polygons, [&](const VectorPolygon& p) {
           return std::ranges::any_of(p.rings, line_meets);
         });
}

/// Once around the globe in columns; 0 where that is not straight along them.
double around(const DemInfo& dem) {
  const bool straight = dem.post_to_crs.x_row == 0 && dem.post_to_crs.y_col == 0;
  return dem.crs_kind == CrsKind::geographic && straight ? dem.period_cols : 0;
}

/// Adds `line` where the DEM has it: as often as it comes by, its columns going around the globe;
/// as it is where it never does.
void add_turns(const VectorLine& line, double turn, const DemInfo& dem,
               std::vector<VectorLine>& out) {
  double west = INFINITY, east = -INFINITY;
  for (const Vec3& p : line) west = std::min(west, p.x), east = std::max(east, p.x);
  const double last = double(dem.cols - 1);
  bool any = false;
  for (double k = std::ceil(-east / turn); west <= east && west + k * turn <= last; ++k) {
    const bool touches_only = west + k * turn == last || east + k * turn == 0;
    if (touches_only && k != 0 && west < east) continue;
    VectorLine there = line;
    for (Vec3& p : there) p.x += k * turn;
    out.push_back(std::move(there));
    any = true;
  }
  if (!any) out.push_back(line);
}

/// Longitudes are the same all the way around the globe, whatever turn the file and the DEM count
/// them in.
void place_on(const DemInfo& dem, VectorShapes& shapes) {
  const double turn = around(dem);
  if (!(turn > 0)) return;
  const auto placed = [&](std::vector<VectorLine>& lines) {
    std::vector<VectorLine> out;
    for (VectorLine& line : lines) {
      unroll(line, turn);
      add_turns(line, turn, dem, out);
    }
    lines = std::move(out);
  };
  placed(shapes.lines);
  for (VectorPolygon& polygon : shapes.polygons) placed(polygon.rings);
}

/// Views that other programs put beside their layers.
const std::set<std::string> kNoLayers = {
    "st_spatial_ref_sys", "st_geometry_columns",      "vector_layers",
    "vector_layers_auth", "vector_layers_statistics", "vector_layers_field_infos",
    "geom_cols_ref_sys",  "spatial_ref_sys_all"};

/// A table holds no more than its file has bytes. A view can go on for ever, and a generated column
/// can be of any size: neither is read, and GDAL is not asked to look at them. Errc::unsupported
/// says which. Of a file that is no SQLite database, nothing.
Result<void> only_tables(const std::string& path) {
  const auto type = file_type_of(path);
  if (!type) return std::unexpected(type.error());
  if (*type != std::filesystem::file_type::regular) return {};
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  const auto head = read_beginning(path, kMagic.size());
  if (!head) return std::unexpected(head.error());
  if (*head != kMagic) return {};
  auto db = Sqlite::open(path, Sqlite::Open::read);
  if (!db) return fail(path, db.error());
  const auto views = db->number(
      fmt::format("SELECT count(*) FROM sqlite_master WHERE type = 'view' AND name NOT IN ('{}')",
                  fmt::join(kNoLayers, "', '")));
  if (!views) return fail(path, views.error());
  if (*views > 0)
    return fail(Errc::unsupported,
                path + ": has views, which are not read: store their rows as tables (ogr2ogr)");
  const auto generated = db->number(
      "SELECT count(*) FROM sqlite_master m, pragma_table_xinfo(m.name) x WHERE m.type = 'table' "
      "AND m.rootpage > 0 AND x.hidden IN (2, 3)");  // 0: of a module, which may not be here
  if (!generated) return fail(path, generated.error());
  if (*generated > 0)
    return fail(Errc::unsupported, path +
                                       ": has generated columns, which are not read: store "
                                       "their values (ogr2ogr)");
  return {};
}

/// What GDAL complained of, unless it was the disk that failed.
std::unexpected<Error> unreadable(const std::string& path, const gdal::VectorFiles& files,
                                  const gdal::Complaints& complaints,
                                  const std::string& otherwise) {
  if (auto ok = files.still_readable(); !ok) return std::unexpected(ok.error());
  return fail(Errc::bad_data, path + ": " + files.shown(complaints.text(otherwise)));
}

Result<Dataset> open_vectors(const std::string& path, const gdal::VectorFiles& files,
                             const gdal::Complaints& complaints) {
  if (auto ok = only_tables(path); !ok) return std::unexpected(ok.error());
  // Of GeoPackages: layers only. Of GML: no file is written beside it.
  const char* const options[] = {"LIST_ALL_TABLES=NO", "WRITE_GFS=NO", nullptr};
  Dataset set(GDALDataset::Open(files.target().c_str(), GDAL_OF_VECTOR | GDAL_OF_READONLY,
                                gdal::vector_drivers(), options));
  for (int i = 0; set && i < set->GetLayerCount(); ++i)
    if (kNoLayers.contains(CPLString(set->GetLayer(i)->GetName()).tolower()))
      return fail(Errc::unsupported, path + ": " + set->GetLayer(i)->GetName() +
                                         " is no layer in other programs' files");
  if (set) return set;
  return unreadable(path, files, complaints,
                    "not a vector file tind reads (GeoJSON, GeoPackage, "
                    "Shapefile, KML, GML, DXF and others)");
}

/// The files that a set was opened from, but those whose state is known. How many there are.
Result<std::size_t> add_others(GDALDataset& set, const gdal::VectorFiles& files,
                               FileStates& states) {
  std::error_code error;
  std::size_t added = 0;
  const CPLStringList names(set.GetFileList());
  for (int i = 0; i < names.Count(); ++i) {
    const std::string name = files.shown(names[i]);
    if (std::ranges::any_of(states.entries(), [&](const auto& e) { return e.path == name; }) ||
        !std::filesystem::is_regular_file(name, error))
      continue;
    if (auto ok = states.add(name); !ok) return std::unexpected(ok.error());
    ++added;
  }
  return added;
}

template <class To, class Dem>
Result<VectorShapes> read_file(const std::string& path, const Dem& dem) {
  // GDAL would also open URLs, and text that looks like a format.
  if (auto there = check_exists(path); !there) return std::unexpected(there.error());
  gdal::register_vectors();
  const gdal::Complaints complaints;
  VectorShapes shapes;
  const auto files = gdal::VectorFiles::read(path, &shapes.files);
  if (!files) return std::unexpected(files.error());
  auto set = open_vectors(path, *files, complaints);
  if (!set) return std::unexpected(set.error());
  const auto others = add_others(**set, *files, shapes.files);
  if (!others) return std::unexpected(others.error());
  if (*others > 0) set = open_vectors(path, *files, complaints);  // they have been looked into
  if (!set) return std::unexpected(set.error());
  Features features(**set, *files);
  for (OGRLayer* layer : (*set)->GetLayers()) {
    if (const auto ok = read_layer<To>(*layer, dem, features, shapes); !ok)
      return fail(path, ok.error());
  }
  if (auto same = shapes.files.unchanged(); !same) return std::unexpected(same.error());
  if (complaints.failed()) return unreadable(path, *files, complaints, "unreadable");
  if (shapes.lines.empty() && shapes.polygons.empty()) {
    return fail(Errc::bad_data,
                path + (shapes.points > 0 ? ": has points only; lines or polygons are needed"
                                          : ": is empty; lines or polygons are needed"));
  }
  return shapes;
}

void note(const VectorLine& line, VectorLayerFacts& facts) {
  for (const Vec3& p : line) {
    if (facts.vertices++ == 0) facts.west = facts.east = p.x, facts.south = facts.north = p.y;
    facts.west = std::min(facts.west, p.x), facts.east = std::max(facts.east, p.x);
    facts.south = std::min(facts.south, p.y), facts.north = std::max(facts.north, p.y);
    if (std::isnan(p.z)) continue;
    if (facts.with_height++ == 0) facts.lowest = facts.highest = p.z;
    facts.lowest = std::min(facts.lowest, p.z), facts.highest = std::max(facts.highest, p.z);
  }
}

Result<VectorLayerFacts> facts_of(OGRLayer& layer, Features& features) {
  VectorLayerFacts facts;
  facts.name = layer.GetName();
  if (const OGRSpatialReference* crs = layer.GetSpatialRef())
    facts.crs = crs->GetName() ? crs->GetName() : "unknown";
  // One at a time: a file may be larger than memory.
  const auto done = features.each(layer, [&](const OGRFeature&, const OGRGeometry* shape) {
    ++facts.features;
    if (!shape) return;
    VectorShapes one;
    add(*shape, AsTheyAre(), one);
    facts.lines += one.lines.size(), facts.polygons += one.polygons.size();
    facts.points += one.points;
    for (const VectorLine& line : one.lines) note(line, facts);
    for (const VectorPolygon& polygon : one.polygons)
      for (const VectorLine& ring : polygon.rings) note(ring, facts);
  });
  if (!done) return std::unexpected(done.error());
  return facts;
}

VectorAttributes::Value value_of(const OGRFeature& feature, int field) {
  if (!feature.IsFieldSetAndNotNull(field)) return {};
  const OGRFieldDefn& kind = *feature.GetFieldDefnRef(field);
  switch (kind.GetType()) {
    case OFTInteger:
      if (kind.GetSubType() == OFSTBoolean) return feature.GetFieldAsInteger(field) != 0;
      [[fallthrough]];
    case OFTInteger64:
      return std::int64_t(feature.GetFieldAsInteger64(field));
    case OFTReal:
      return feature.GetFieldAsDouble(field);
    default:
      return std::string(const_cast<OGRFeature&>(feature).GetFieldAsString(field));
  }
}

Result<void> add_attributes(OGRLayer& layer, Features& features, VectorAttributes& out) {
  const OGRFeatureDefn& fields = *layer.GetLayerDefn();
  std::vector<std::size_t> column;
  for (int k = 0; k < fields.GetFieldCount(); ++k) {
    const std::string name = const_cast<OGRFeatureDefn&>(fields).GetFieldDefn(k)->GetNameRef();
    const auto found = std::ranges::find(out.names, name);
    column.push_back(std::size_t(found - out.names.begin()));
    if (found == out.names.end()) out.names.push_back(name);
  }
  return features.each(layer, [&](const OGRFeature& feature, const OGRGeometry*) {
    auto& values = out.of_feature.emplace_back(out.names.size());
    for (std::size_t k = 0; k < column.size(); ++k) values[column[k]] = value_of(feature, int(k));
  });
}

/// take(set, its features) of a file that is there.
template <class Take>
Result<void> look_through(const std::string& path, const Take& take) {
  if (auto there = check_exists(path); !there) return std::unexpected(there.error());
  gdal::register_vectors();
  const gdal::Complaints complaints;
  const auto files = gdal::VectorFiles::read(path, nullptr);
  if (!files) return std::unexpected(files.error());
  const auto set = open_vectors(path, *files, complaints);
  if (!set) return std::unexpected(set.error());
  Features features(**set, *files);
  if (const Result<void> ok = take(**set, features); !ok) return fail(path, ok.error());
  if (complaints.failed()) return unreadable(path, *files, complaints, "unreadable");
  return {};
}

}  // namespace

std::vector<double> own_heights(const VectorPolygon& polygon) {
  std::vector<double> heights;
  for (const VectorLine& ring : polygon.rings) {
    const bool closed =
        ring.size() > 1 && ring.front().x == ring.back().x && ring.front().y == ring.back().y;
    for (const Vec3& p : std::span(ring).first(ring.size() - closed))
      if (std::isfinite(p.z)) heights.push_back(p.z);
  }
  return heights;
}

Result<VectorAttributes> read_attributes(const std::string& path) {
  VectorAttributes all;
  const auto done = look_through(path, [&](GDALDataset& set, Features& features) -> Result<void> {
    for (OGRLayer* layer : set.GetLayers())
      if (auto ok = add_attributes(*layer, features, all); !ok) return ok;
    return {};
  });
  if (!done) return std::unexpected(done.error());
  for (auto& values : all.of_feature) values.resize(all.names.size());
  return all;
}

Result<VectorFacts> vector_facts(const std::string& path) {
  VectorFacts facts;
  const auto done = look_through(path, [&](GDALDataset& set, Features& features) -> Result<void> {
    if (GDALDriver* const driver = set.GetDriver()) facts.driver = driver->GetDescription();
    for (OGRLayer* layer : set.GetLayers()) {
      auto one = facts_of(*layer, features);
      if (!one) return std::unexpected(one.error());
      facts.layers.push_back(std::move(*one));
    }
    return {};
  });
  if (!done) return std::unexpected(done.error());
  return facts;
}

Result<VectorShapes> read_vectors(const std::string& path, const DemSource& dem) {
  auto shapes = read_file<ToPosts>(path, dem);
  if (!shapes) return shapes;
  place_on(dem.info(), *shapes);
  if (!meets(*shapes, dem.info())) {
    return fail(Errc::bad_data,
                path + ": nothing in it lies on the DEM; is its CRS the right one?");
  }
  return shapes;
}

Result<VectorShapes> read_vectors_on_globe(const std::string& path, const DemInfo& dem) {
  return read_file<ToGlobe>(path, dem);
}

}  // namespace tind
