// The first file's grid, continued in all directions, is the grid of the mosaic. A file whose posts
// do not fall on it is refused rather than resampled: resampling invents heights, and which way to
// do it is the operator's decision.

#include "terrain/raster/gdal/heights/gdal_mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "terrain/raster/gdal/heights/apart_file.h"
#include "terrain/raster/gdal/heights/source_pool.h"
#include "terrain/raster/gdal/heights/unread_sidecar.h"
#include "terrain/raster/remote/objects.h"

namespace tind::gdal {
namespace {

constexpr double kSameStep = 1e-6, kWholePost = 0.01;

bool close(double a, double b, double scale) { return std::abs(a - b) <= kSameStep * scale; }

bool same_steps(const Affine& a, const Affine& b) {
  const double scale = std::max({std::abs(a.x_col), std::abs(a.y_row), std::abs(a.x_row)});
  return close(a.x_col, b.x_col, scale) && close(a.x_row, b.x_row, scale) &&
         close(a.y_col, b.y_col, scale) && close(a.y_row, b.y_row, scale);
}

/// Posts between two files: a degree a post around the globe is 360, a metre a post 4 * 10^7.
constexpr double kFarthest = 1u << 31;

bool whole(double posts) { return std::abs(posts - std::round(posts)) <= kWholePost; }

/// The same of several files, in a line.
class ForAll {
 public:
  void add(const std::string& file, const std::string& what) {
    if (file.empty()) return;
    if (count_++ == 0) file_ = file, what_ = what;
  }
  std::string text() const {
    return file_ + (count_ > 1 ? fmt::format(" and {} more", count_ - 1) : "") + what_;
  }

 private:
  std::size_t count_ = 0;
  std::string file_, what_;
};

Error mismatch(const FileFacts& a, const FileFacts& b, const std::string& why) {
  return {Errc::unsupported,
          fmt::format("{} and {} cannot be one source: {}; bring them to one grid with gdalwarp "
                      "(-t_srs, -tr, -tap)",
                      a.path, b.path, why)};
}

Result<std::unique_ptr<HeightFile>> opened_here(const std::string& path, const DemOptions& options,
                                                const Pool& pool) {
  return RasterFile::open(path, options, pool.idle);
}

}  // namespace

Result<Mosaic> Mosaic::open(std::span<const std::string> paths, const DemOptions& options,
                            const Pool& pool) {
  if (paths.empty()) return fail(Errc::invalid_argument, "no raster file given");
  Mosaic mosaic;
  const auto remote = std::ranges::find_if(paths, remote::is_remote);
  if (pool.team && pool.strict && remote != paths.end())
    return fail(Errc::unsupported,
                *remote +
                    ": processes of a sandbox have no network; copy the DEM here, or leave "
                    "the sandbox out for it");
  const bool apart = pool.team && remote == paths.end();
  const auto crew = apart ? Crew::of(pool.team, paths, options) : nullptr;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    auto file = crew ? ApartFile::open(crew, i) : opened_here(paths[i], options, pool);
    if (!file) return std::unexpected(file.error());
    if (auto ok = mosaic.add(std::move(*file), options); !ok) return std::unexpected(ok.error());
  }
  mosaic.move_origin();
  return mosaic;
}

Mosaic Mosaic::of(std::unique_ptr<HeightFile> file) {
  Mosaic mosaic;
  mosaic.post_to_crs_ = file->facts().post_to_crs;
  mosaic.parts_.push_back({std::move(file), 0, 0});
  mosaic.move_origin();
  return mosaic;
}

Result<void> Mosaic::add(std::unique_ptr<HeightFile> file, const DemOptions& options) {
  const FileFacts& b = file->facts();
  if (parts_.empty()) {
    post_to_crs_ = b.post_to_crs;
    parts_.push_back({std::move(file), 0, 0});
    return {};
  }
  const FileFacts& a = facts();
  if (!a.has_geotransform || !b.has_geotransform)
    return std::unexpected(mismatch(a, b, "a file without a geotransform has no place"));
  if (a.crs.kind != b.crs.kind || (a.crs.kind == CrsKind::none ? a.crs.unit_m != b.crs.unit_m
                                                               : !same_crs(a.crs.wkt, b.crs.wkt)))
    return std::unexpected(mismatch(a, b, "their CRSs differ"));
  // What is said is said of files that do not say it: not of one that does, and another beside it.
  const bool differ = a.crs.datum != b.crs.datum ||
                      (a.crs.datum == VerticalDatum::unknown && a.crs.vertical != b.crs.vertical);
  const auto agrees = [&](const FileFacts& f) {
    return f.crs.datum == options.from_datum || f.crs.datum == VerticalDatum::unknown;
  };
  if (differ && (options.from_datum == VerticalDatum::unknown || !agrees(a) || !agrees(b)))
    return std::unexpected(mismatch(
        a, b, "their vertical datums differ (--from-datum is for files that do not say theirs)"));
  if (!same_steps(a.post_to_crs, b.post_to_crs))
    return std::unexpected(mismatch(
        a, b,
        fmt::format("their post spacings differ ({} x {} and {} x {})", a.post_to_crs.x_col,
                    a.post_to_crs.y_row, b.post_to_crs.x_col, b.post_to_crs.y_row)));
  Vec2 origin{b.post_to_crs.x0, b.post_to_crs.y0};
  Vec2 corner = b.post_to_crs.apply(double(b.cols - 1), double(b.rows - 1));
  if (a.crs.turn > 0) {  // 179..180 and -180..-179 are neighbours
    const double middle = a.post_to_crs.apply(double(a.cols - 1) / 2, double(a.rows - 1) / 2).x;
    const double turns = std::round((middle - (origin.x + corner.x) / 2) / a.crs.turn);
    origin.x += turns * a.crs.turn;
    corner.x += turns * a.crs.turn;
  }
  const Vec2 first = post_to_crs_.invert(origin.x, origin.y);
  const Vec2 last = post_to_crs_.invert(corner.x, corner.y);
  const double farthest =
      std::max({std::abs(first.x), std::abs(first.y), std::abs(last.x), std::abs(last.y)});
  if (!(farthest <= kFarthest))
    return std::unexpected(mismatch(
        a, b,
        fmt::format("they are {:.3g} posts apart; is one of them in another place?", farthest)));
  if (!whole(first.x) || !whole(first.y) || !whole(last.x) || !whole(last.y))
    return std::unexpected(
        mismatch(a, b,
                 fmt::format("their grids are shifted by a part of a post ({:.3f}, {:.3f})",
                             first.x - std::round(first.x), first.y - std::round(first.y))));
  parts_.push_back({std::move(file), std::llround(first.x), std::llround(first.y)});
  return {};
}

void Mosaic::move_origin() {
  std::int64_t west = 0, north = 0, east = 0, south = 0;
  for (const Part& part : parts_) {
    west = std::min(west, part.col);
    north = std::min(north, part.row);
    east = std::max(east, part.col + part.file->facts().cols);
    south = std::max(south, part.row + part.file->facts().rows);
  }
  for (Part& part : parts_) {
    part.col -= west;
    part.row -= north;
  }
  const Vec2 origin = post_to_crs_.apply(double(west), double(north));
  post_to_crs_.x0 = origin.x;
  post_to_crs_.y0 = origin.y;
  cols_ = east - west;
  rows_ = south - north;
  place_parts();
}

void Mosaic::place_parts() {
  places_.clear();
  for (const Part& part : parts_) places_.push_back({part.file.get(), part.col, part.row});
}

void Mosaic::close_around(std::int64_t period) {
  place_parts();
  for (const Part& part : parts_)
    if (part.col + part.file->facts().cols > period)
      places_.push_back({part.file.get(), part.col - period, part.row});
}

std::vector<PostRect> Mosaic::covered() const {
  std::vector<PostRect> files;
  files.reserve(parts_.size());
  for (const Part& p : parts_)
    files.push_back(
        {p.col, p.row, p.col + p.file->facts().cols - 1, p.row + p.file->facts().rows - 1});
  std::ranges::sort(files, {}, &PostRect::row);
  std::vector<PostRect> ways;
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t k = i + 1; k < files.size() && files[k].row <= files[i].last_row + 1; ++k) {
      const PostRect &a = files[i], &b = files[k];
      const std::int64_t c0 = std::max(a.col, b.col), c1 = std::min(a.last_col, b.last_col);
      const std::int64_t r0 = std::max(a.row, b.row), r1 = std::min(a.last_row, b.last_row);
      const bool overlap = c0 <= c1 && r0 <= r1, apart = c0 > c1 + 1 || r0 > r1 + 1;
      if (!overlap && !apart)
        ways.push_back({std::min(c0, c1), std::min(r0, r1), std::max(c0, c1), std::max(r0, r1)});
    }
  files.insert(files.end(), ways.begin(), ways.end());
  return files;
}

std::vector<std::string> Mosaic::warnings() const {
  ForAll other_crs, unread, prj;
  for (const Part& part : parts_) {
    const FileFacts& facts = part.file->facts();
    if (!facts.own_crs.empty())
      other_crs.add(
          facts.path,
          fmt::format(
              ": says that its CRS is '{}'; its coordinates are taken as '{}', as --crs says",
              facts.own_crs, facts.crs.name));
    const bool lacks_crs = facts.has_geotransform && facts.crs.kind == CrsKind::none;
    unread.add(unread_sidecar(facts.path, facts.content, !lacks_crs),
               ", which is not read: where it is so, say it with --crs, --scale, --offset or "
               "--nodata, or put it into the file (gdal_translate to GeoTIFF)");
    if (lacks_crs)
      prj.add(prj_without_crs(facts.path),
              ": gives the raster no CRS (no WKT, or GDAL does not look there in this format); say "
              "what it is with --crs");
  }
  std::vector<std::string> lines;
  for (const ForAll* of : {&other_crs, &unread, &prj})
    if (!of->text().empty()) lines.push_back(of->text());
  return lines;
}

bool Mosaic::exact() const {
  return std::ranges::all_of(parts_, [](const Part& p) { return p.file->facts().exact; });
}

Result<void> Mosaic::read(std::int64_t col, std::int64_t row, int cols, int rows,
                          std::span<double> out) const {
  std::ranges::fill(out, std::nan(""));
  std::size_t missing = out.size();
  std::vector<double> window;
  for (const Place& part : places_) {
    const FileFacts& facts = part.file->facts();
    const auto c0 = std::max(col, part.col), c1 = std::min(col + cols, part.col + facts.cols);
    const auto r0 = std::max(row, part.row), r1 = std::min(row + rows, part.row + facts.rows);
    if (c0 >= c1 || r0 >= r1) continue;
    const int w = int(c1 - c0), h = int(r1 - r0);
    if (w == cols && h == rows && missing == out.size()) {  // nearly always
      if (auto ok = part.file->read(int(c0 - part.col), int(r0 - part.row), w, h, out); !ok)
        return ok;
      missing = std::size_t(std::ranges::count_if(out, [](double z) { return std::isnan(z); }));
      if (missing == 0) break;
      continue;
    }
    window.resize(std::size_t(w) * h);
    if (auto ok = part.file->read(int(c0 - part.col), int(r0 - part.row), w, h, window); !ok)
      return ok;
    for (int r = 0; r < h; ++r)
      for (int c = 0; c < w; ++c) {
        double& z = out[std::size_t(r0 - row + r) * cols + std::size_t(c0 - col + c)];
        if (!std::isnan(z)) continue;
        z = window[std::size_t(r) * w + c];
        if (!std::isnan(z)) --missing;
      }
    if (missing == 0) break;
  }
  return {};
}

Result<void> Mosaic::read_lattice(std::span<const std::int64_t> cols,
                                  std::span<const std::int64_t> rows, std::span<double> out) const {
  std::ranges::fill(out, std::nan(""));
  std::vector<HeightFile::Post> posts;
  for (const Place& part : places_) {
    const FileFacts& facts = part.file->facts();
    posts.clear();
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const std::int64_t row = rows[j] - part.row;
      if (row < 0 || row >= facts.rows) continue;
      for (std::size_t i = 0; i < cols.size(); ++i) {
        const std::int64_t col = cols[i] - part.col;
        double& z = out[j * cols.size() + i];
        if (col < 0 || col >= facts.cols || !std::isnan(z)) continue;
        posts.push_back({int(col), int(row), &z});
      }
    }
    if (posts.empty()) continue;
    if (auto ok = part.file->read_posts(posts); !ok) return ok;
  }
  return {};
}

Result<void> Mosaic::unchanged() const {
  for (const Part& part : parts_)
    if (auto same = part.file->unchanged(); !same) return same;
  return {};
}

Result<std::string> Mosaic::fingerprint() const {
  std::string text;
  for (const Part& part : parts_) {
    auto one = part.file->fingerprint();
    if (!one) return one;
    text += fmt::format("{} {} {} {}\n{}", part.file->facts().driver, part.col, part.row,
                        part.file->facts().crs.wkt, *one);
  }
  return text;
}

const FileFacts& Mosaic::facts_at(std::int64_t col, std::int64_t row) const {
  for (const Place& place : places_) {
    const FileFacts& facts = place.file->facts();
    if (col >= place.col && row >= place.row && col < place.col + facts.cols &&
        row < place.row + facts.rows)
      return facts;
  }
  return facts();
}

std::vector<UndeclaredNodata> Mosaic::undeclared_nodata() const {
  std::vector<UndeclaredNodata> found;
  for (std::size_t k = 0; k < std::size(kCustomaryNodata); ++k) {
    UndeclaredNodata one{.value = kCustomaryNodata[k], .posts = 0, .files = {}};
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const std::uint64_t posts = parts_[i].file->customary(k);
      if (posts == 0) continue;
      one.posts += posts;
      one.files.push_back(i);
    }
    if (one.posts > 0) found.push_back(std::move(one));
  }
  std::ranges::stable_sort(found, std::ranges::greater(), &UndeclaredNodata::posts);
  return found;
}

}  // namespace tind::gdal
