// The DEM as one array: a mosaic of files (gdal_mosaic), a frame on the globe (gdal_frame), and
// here the finished heights between them: poles, vertical datum, float, cached in blocks.

#include "terrain/raster/dem_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <mutex>
#include <optional>

#include "terrain/base/hash.h"
#include "terrain/raster/block_cache.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/gdal/crs/gdal_frame.h"
#include "terrain/raster/gdal/heights/datum_choice.h"
#include "terrain/raster/gdal/heights/datum_shift.h"
#include "terrain/raster/gdal/heights/gdal_mosaic.h"
#include "terrain/raster/gdal/heights/held_file.h"
#include "terrain/raster/gdal/heights/source_pool.h"
#include "terrain/raster/held_posts.h"
#include "terrain/raster/nodata.h"

namespace tind {
namespace {

constexpr int kBlock = 256;  // posts a side
/// From this step on most of a block would be read for nothing.
constexpr int kSparseStep = 64;
/// Heights that are converted must be below this, so that the rounding to float has a known bound.
constexpr double kMaxHeight = 16384, kMaxSourceHeight = 65536;
/// The others are floats already, or integers up to this.
constexpr double kMaxExact = 1 << 24;

std::int64_t modulo(std::int64_t a, std::int64_t n) { return ((a % n) + n) % n; }

class RasterSource final : public DemSource {
 public:
  static Result<std::shared_ptr<const DemSource>> open(std::span<const std::string> named,
                                                       const DemOptions& options);
  /// `files`: as DemInfo has them; `warnings`: what is known before.
  static Result<std::shared_ptr<const DemSource>> of(gdal::Mosaic, std::shared_ptr<gdal::Pool>,
                                                     std::span<const std::string> files,
                                                     std::vector<std::string> warnings,
                                                     const DemOptions&);

  const DemInfo& info() const override { return info_; }
  Result<HeightGrid> read(std::int64_t col, std::int64_t row, int cols, int rows) const override {
    return read_decimated(col, row, cols, rows, 1);
  }
  Result<HeightGrid> read_decimated(std::int64_t col, std::int64_t row, int cols, int rows,
                                    int step) const override;
  void to_post(std::span<const Geographic> in, std::span<Vec2> out) const override {
    frame_.to_post(in, out);
  }
  void to_geographic(std::span<const Vec2> in, std::span<Geographic> out) const override {
    frame_.to_geographic(in, out);
  }
  bool is_plain_geographic() const override { return frame_.plain(); }
  std::vector<UndeclaredNodata> undeclared_nodata() const override {
    return mosaic_.undeclared_nodata();
  }
  Result<void> unchanged() const override {
    if (auto same = geoids_.unchanged(); !same) return same;
    return mosaic_.unchanged();
  }
  ~RasterSource() override { pool_->heights->forget(id_); }

 private:
  RasterSource(gdal::Mosaic mosaic, gdal::Frame frame, std::shared_ptr<gdal::Pool> pool)
      : mosaic_(std::move(mosaic)), frame_(std::move(frame)), pool_(std::move(pool)) {}
  Result<void> describe(std::span<const std::string> files, const DemOptions&);
  Result<void> settle_datum(const gdal::FileFacts&, const DemOptions&);
  Result<double> number_in_file(std::int64_t col, std::int64_t row) const;
  std::unexpected<Error> too_high(double z, std::int64_t col, std::int64_t row) const;
  std::int64_t source_col(std::int64_t col) const;
  std::string places_text(const gdal::FileFacts&, const DemOptions&) const;
  Result<void> finish(std::int64_t col, std::int64_t row, int cols, int rows,
                      std::span<double> heights, std::span<float> out) const;
  void drop_beyond_poles(std::int64_t row, int cols, int rows, std::span<double> heights) const;
  Result<void> check_places(const DemOptions&) const;
  Result<HeightGrid> load(std::int64_t col, std::int64_t row, int cols, int rows) const;
  Result<BlockCache::Block> block(std::int64_t block_col, std::int64_t block_row) const;
  Result<void> read_sparse(std::int64_t col, std::int64_t row, int step, HeightGrid& out) const;
  Result<void> read_blocks(std::int64_t col, std::int64_t row, int step, HeightGrid& out) const;

  gdal::Mosaic mosaic_;
  gdal::Frame frame_;
  DemInfo info_;
  std::optional<DatumShift> shift_;
  std::string datum_identity_;
  FileStates geoids_;  // that the options name
  double max_height_ = kMaxExact;
  bool keeps_units_ = false;  // heights are in the file's unit
  const std::shared_ptr<gdal::Pool> pool_;
  const std::uint64_t id_ = BlockCache::new_source();
  mutable std::array<std::mutex, 61> loading_;
};

/// What the numbers of the files are said to mean; empty where nothing is.
std::string numbers_text(const DemOptions& options) {
  std::string text;
  if (options.band > 0) text += fmt::format(" band {}", options.band);
  if (options.encoding != HeightEncoding::number) text += " " + name_of(options.encoding);
  if (options.scale) text += fmt::format(" scale {}", *options.scale);
  if (options.offset) text += fmt::format(" offset {}", *options.offset);
  return text;
}

/// What heights of the same files were otherwise before: indexes of theirs are none of these.
std::string RasterSource::places_text(const gdal::FileFacts& facts,
                                      const DemOptions& options) const {
  std::string text;
  if (frame_.wraps() && mosaic_.cols() > std::llround(frame_.period())) text += " closed";
  if (frame_.pole() != 90) text += " pole";
  if (options.from_datum.kind() == VerticalDatum::crs && facts.crs.vertical_unit_m > 0)
    text += fmt::format(" unit {}", facts.z_unit_m);
  constexpr double kBeside = 0.1;  // degrees
  if (shift_ && !frame_.plain() && info_.bounds.east > 180 - kBeside) text += " antimeridian";
  return text;
}

/// The column of the files that holds a column of the world, or -1.
std::int64_t RasterSource::source_col(std::int64_t col) const {
  if (info_.wraps_longitude) col = modulo(col, std::int64_t(info_.period_cols));
  return col >= 0 && col < info_.cols ? col : -1;
}

double in_digits(double number, int digits) {
  const std::string text = fmt::format("{:.{}g}", number, digits);
  double as_said = number;
  std::from_chars(text.data(), text.data() + text.size(), as_said);
  return as_said;
}

/// A post's number before unit, scale and datum made a height of it, as --nodata takes it.
Result<double> RasterSource::number_in_file(std::int64_t col, std::int64_t row) const {
  double height = 0;
  if (auto ok = mosaic_.read(col, row, 1, 1, {&height, 1}); !ok) return std::unexpected(ok.error());
  const RasterContent& has = mosaic_.facts_at(col, row).content;
  const double unit = keeps_units_ ? 1 : has.unit_m;
  const double back = (height / unit - has.offset) / has.scale;
  // The way back is off by some of the last of 16 digits, which numbers of 64 bits need.
  for (const int digits : {15, 16, 17}) {
    const double number = in_digits(back, digits);
    if (number * (has.scale * unit) + has.offset * unit == height) return number;
  }
  return in_digits(back, 15);
}

std::unexpected<Error> RasterSource::too_high(double z, std::int64_t col, std::int64_t row) const {
  const std::string nodata = undeclared_nodata_text(*this);
  const auto number = number_in_file(col, row);
  if (!number) return std::unexpected(number.error());
  const std::string what =
      fmt::format("a height of {} (column {}, row {}) is beyond {} m",
                  *number == z ? fmt::format("{} m", z)
                               : fmt::format("{:.15g} m, {} as the file has it,", z, *number),
                  col, row, max_height_);
  if (!nodata.empty()) return fail(Errc::bad_data, nodata + " (" + what + ")");
  return fail(
      Errc::bad_data,
      fmt::format("{}: {}; where it means no data say --nodata {}{}{}, else state the file's "
                  "unit or scale with gdal_edit.py",
                  mosaic_.facts_at(col, row).path, what, info_.nodata_said,
                  info_.nodata_said.empty() ? "" : ",", *number));
}

Result<void> RasterSource::finish(std::int64_t col, std::int64_t row, int cols, int rows,
                                  std::span<double> heights, std::span<float> out) const {
  drop_beyond_poles(row, cols, rows, heights);
  if (shift_)
    if (auto ok = shift_->add(col, row, cols, rows, heights); !ok)
      return fail(info_.files[0], ok.error());
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double z = heights[i];
    if (std::abs(z) > max_height_)
      return too_high(z, col + std::int64_t(i) % cols, row + std::int64_t(i) / cols);
    out[i] = float(z);
  }
  return {};
}

/// Rows that exist in files, not on the globe: nobody converts what they hold, or finds it too
/// high.
void RasterSource::drop_beyond_poles(std::int64_t row, int cols, int rows,
                                     std::span<double> heights) const {
  const Affine& map = info_.post_to_crs;
  if (info_.crs_kind != CrsKind::geographic || map.x_row != 0 || map.y_col != 0) return;
  for (int r = 0; r < rows; ++r)
    if (std::abs(map.y0 + double(row + r) * map.y_row) > frame_.pole() + 1e-9)
      std::ranges::fill(heights.subspan(std::size_t(r) * cols, cols), std::nan(""));
}

Result<HeightGrid> RasterSource::load(std::int64_t col, std::int64_t row, int cols,
                                      int rows) const {
  HeightGrid grid(cols, rows);
  // Half a megabyte that stays: to take its pages anew for each block costs a third of the reading.
  thread_local std::vector<double> kept;
  kept.resize(std::max(kept.size(), grid.size()));
  const std::span<double> heights(kept.data(), grid.size());
  if (auto ok = mosaic_.read(col, row, cols, rows, heights); !ok)
    return std::unexpected(ok.error());
  if (auto ok = finish(col, row, cols, rows, heights, grid.values()); !ok)
    return std::unexpected(ok.error());
  return grid;
}

Result<BlockCache::Block> RasterSource::block(std::int64_t block_col,
                                              std::int64_t block_row) const {
  const std::uint64_t place = std::uint64_t(block_row) << 32 | std::uint64_t(block_col);
  const BlockCache::Key key{id_, place};
  if (auto found = pool_->heights->find(key)) return found;
  // Neighbouring tiles are built at once and miss the same block: one loads it, the others wait.
  const std::lock_guard one_at_a_time(loading_[place % loading_.size()]);
  if (auto found = pool_->heights->find(key)) return found;
  const std::int64_t col = block_col * kBlock, row = block_row * kBlock;
  auto grid = load(col, row, int(std::min<std::int64_t>(kBlock, info_.cols - col)),
                   int(std::min<std::int64_t>(kBlock, info_.rows - row)));
  if (!grid) return std::unexpected(grid.error());
  auto made = std::make_shared<const HeightGrid>(std::move(*grid));
  pool_->heights->insert(key, made);
  return made;
}

/// Far fewer posts than blocks hold: past the cache, post by post.
Result<void> RasterSource::read_sparse(std::int64_t col, std::int64_t row, int step,
                                       HeightGrid& out) const {
  std::vector<std::int64_t> cols(out.cols()), rows(out.rows());
  for (int i = 0; i < out.cols(); ++i) cols[i] = source_col(col + std::int64_t(i) * step);
  for (int j = 0; j < out.rows(); ++j) rows[j] = row + std::int64_t(j) * step;
  std::vector<double> heights(out.size());
  if (auto ok = mosaic_.read_lattice(cols, rows, heights); !ok) return ok;
  for (int j = 0; j < out.rows(); ++j)
    for (int i = 0; i < out.cols(); ++i) {
      double& z = heights[std::size_t(j) * out.cols() + i];
      if (std::isnan(z)) continue;
      if (auto ok = finish(cols[i], rows[j], 1, 1, {&z, 1}, {&out.at(i, j), 1}); !ok) return ok;
    }
  return {};
}

/// Block by block, so that each is fetched once: `j` runs inside a row of blocks, `i` inside a
/// block, and not past the column where a globe begins again.
Result<void> RasterSource::read_blocks(std::int64_t col, std::int64_t row, int step,
                                       HeightGrid& out) const {
  const std::int64_t end_col = info_.wraps_longitude ? std::int64_t(info_.period_cols) : info_.cols;
  for (int j0 = 0, j1; j0 < out.rows(); j0 = j1) {
    const std::int64_t first_row = row + std::int64_t(j0) * step;
    j1 = j0 + 1;
    if (first_row < 0 || first_row >= info_.rows) continue;
    const std::int64_t block_row = first_row / kBlock;
    while (j1 < out.rows() && (row + std::int64_t(j1) * step) / kBlock == block_row &&
           row + std::int64_t(j1) * step < info_.rows)
      ++j1;
    for (int i = 0, run; i < out.cols(); i += run) {
      run = 1;
      const std::int64_t c = source_col(col + std::int64_t(i) * step);
      if (c < 0) continue;
      const auto held = block(c / kBlock, block_row);
      if (!held) return std::unexpected(held.error());
      const HeightGrid& posts = **held;
      const int first = int(c % kBlock);
      const auto left = int(std::min<std::int64_t>(posts.cols() - first, end_col - c));
      run = std::min(out.cols() - i, (left - 1) / step + 1);
      for (int j = j0; j < j1; ++j) {
        const auto from = posts.row(int((row + std::int64_t(j) * step) % kBlock)).subspan(first);
        const auto to = out.row(j).subspan(std::size_t(i), std::size_t(run));
        if (step == 1)
          std::copy_n(from.begin(), run, to.begin());
        else
          for (int k = 0; k < run; ++k) to[std::size_t(k)] = from[std::size_t(k) * step];
      }
    }
  }
  return {};
}

Result<HeightGrid> RasterSource::read_decimated(std::int64_t col, std::int64_t row, int cols,
                                                int rows, int step) const {
  assert(cols >= 0 && rows >= 0 && step >= 1);
  HeightGrid out(cols, rows);
  auto ok =
      step >= kSparseStep ? read_sparse(col, row, step, out) : read_blocks(col, row, step, out);
  if (!ok) return std::unexpected(ok.error());
  return out;
}

Result<void> RasterSource::settle_datum(const gdal::FileFacts& facts, const DemOptions& options) {
  auto choice = choose_datum(facts, info_.bounds, options);
  if (!choice) return std::unexpected(choice.error());
  info_.vertical_crs = facts.crs.vertical;
  info_.accuracy = options.accuracy;
  info_.source_datum = choice->source;
  info_.overruled_datum = choice->overruled;
  info_.datum = choice->result;
  info_.datum_way = choice->way();
  datum_identity_ = choice->identity();
  for (const VerticalDatum& datum : {options.from_datum, options.to_datum.named})
    if (datum.kind() == VerticalDatum::file)
      if (auto ok = geoids_.add(datum.text()); !ok) return ok;
  for (std::string& line : choice->warnings) info_.warnings.push_back(std::move(line));
  if (choice->shifts)
    shift_.emplace(choice->from, choice->to, frame_,
                   options.keep_source_units ? facts.z_unit_m : 1);
  return {};
}

/// Of every file some posts are on the globe, and none is far from it.
Result<void> RasterSource::check_places(const DemOptions& options) const {
  const Errc code = options.crs.empty() ? Errc::bad_data : Errc::invalid_argument;
  const auto path = [&](const PostRect& part) { return mosaic_.facts_at(part.col, part.row).path; };
  for (const PostRect& part : info_.covered) {
    if (!frame_.touches_globe(part)) {
      const Vec2 first = info_.post_to_crs.apply(double(part.col), double(part.row));
      return fail(code,
                  fmt::format("{}: its coordinates (the first post is at {:.10g}, {:.10g}) lie "
                              "outside of its CRS, {}; say with --crs which one they are in",
                              path(part), first.x, first.y, info_.crs_name));
    }
    if (frame_.fits_globe(part)) continue;
    const auto [least, most] = frame_.coordinates(part);
    return fail(code, fmt::format("{}: its coordinates run from {:.10g}, {:.10g} to {:.10g}, "
                                  "{:.10g}, which are no longitudes and latitudes as its CRS, {}, "
                                  "has them; say with --crs which one they are in, or cut "
                                  "the raster to the globe (gdal_translate -projwin)",
                                  path(part), least.x, least.y, most.x, most.y, info_.crs_name));
  }
  return {};
}

Result<void> RasterSource::describe(std::span<const std::string> files, const DemOptions& options) {
  const gdal::FileFacts& facts = mosaic_.facts();
  keeps_units_ = options.keep_source_units;
  info_.files.assign(files.begin(), files.end());
  info_.driver = facts.driver;
  info_.cols = mosaic_.cols();
  info_.rows = mosaic_.rows();
  info_.has_geotransform = facts.has_geotransform;
  info_.post_to_crs = frame_.post_to_crs();
  info_.crs_kind = facts.crs.kind;
  info_.crs_wkt = facts.crs.wkt;
  info_.crs_name = facts.crs.name;
  info_.crs_unit_m = facts.crs.unit_m;
  info_.crs_accuracy_m = frame_.crs_way().accuracy_m;
  info_.crs_way = frame_.crs_way().name;
  if (!frame_.crs_way().warning.empty())
    info_.warnings.push_back(facts.path + ": " + frame_.crs_way().warning);
  info_.covered = mosaic_.covered();
  if (auto ok = check_places(options); !ok) return ok;
  info_.z_unit_m = facts.z_unit_m;
  info_.nodata_said = nodata_text(options);
  info_.bounds = frame_.bounds();
  const auto add = [&](const PostRect& part) {
    for (const GeoRect& extent : frame_.extents(part)) info_.extents.push_back(extent);
  };
  for (const PostRect& part : info_.covered) {
    add(part);
    if (frame_.wraps() && part.last_col == info_.cols - 1)  // on to the first column
      add({part.last_col, part.row, std::llround(frame_.period()), part.last_row});
  }
  info_.wraps_longitude = frame_.wraps();
  info_.period_cols = frame_.period();
  const Vec2 spacing = frame_.spacing_m();
  if (!std::isfinite(spacing.x) || !std::isfinite(spacing.y))
    return fail(Errc::bad_data,
                facts.path +
                    ": its posts are so far apart that the middle between them is no "
                    "place on the globe: name those of one region at a time");
  info_.spacing_x_m = spacing.x;
  info_.spacing_y_m = spacing.y;

  for (std::string& line : mosaic_.warnings()) info_.warnings.push_back(std::move(line));
  if (auto ok = settle_datum(facts, options); !ok) return ok;
  if (shift_ || !mosaic_.exact()) {
    max_height_ = options.keep_source_units ? kMaxSourceHeight : kMaxHeight;
    info_.rounding_m = std::ldexp(max_height_, -25);  // half an ulp just below it
  }

  auto content = mosaic_.fingerprint();
  if (!content) return std::unexpected(content.error());
  *content += fmt::format("{} {} {}", name(info_.source_datum), name(info_.datum),
                          options.keep_source_units);
  if (options.ignore_declared_nodata) *content += " none";
  for (const double nodata : options.nodata) *content += fmt::format(" {}", nodata);
  *content += numbers_text(options) + datum_identity_ + places_text(facts, options);
  // Where PROJ's grids place the posts: they may be there tomorrow, and not today.
  if (info_.crs_accuracy_m.value_or(1) != 0) *content += info_.crs_way;
  info_.fingerprint = hash128(*content).text();
  return {};
}

Result<std::shared_ptr<const DemSource>> RasterSource::open(std::span<const std::string> named,
                                                            const DemOptions& options) {
  auto inputs = dem_files(named, options);
  if (!inputs) return std::unexpected(inputs.error());
  const std::vector<std::string>& files = inputs->files;
  auto pool = gdal::Pool::of(options);
  auto mosaic = gdal::Mosaic::open(files, options, *pool);
  if (!mosaic) return std::unexpected(mosaic.error());
  return of(std::move(*mosaic), std::move(pool), files, std::move(inputs->warnings), options);
}

Result<std::shared_ptr<const DemSource>> RasterSource::of(gdal::Mosaic mosaic,
                                                          std::shared_ptr<gdal::Pool> pool,
                                                          std::span<const std::string> files,
                                                          std::vector<std::string> warnings,
                                                          const DemOptions& options) {
  auto frame =
      gdal::Frame::make(mosaic.facts().crs, mosaic.post_to_crs(), mosaic.cols(), mosaic.rows());
  if (!frame) return fail(files[0], frame.error());
  if (frame->wraps()) mosaic.close_around(std::llround(frame->period()));
  std::shared_ptr<RasterSource> source(
      new RasterSource(std::move(mosaic), std::move(*frame), std::move(pool)));
  source->info_.warnings = std::move(warnings);
  if (auto ok = source->describe(files, options); !ok) return std::unexpected(ok.error());
  return source;
}

}  // namespace

Result<std::shared_ptr<const DemSource>> DemSource::open(std::span<const std::string> files,
                                                         const DemOptions& options) {
  return RasterSource::open(files, options);
}

Result<std::shared_ptr<const DemSource>> dem_of(HeldPosts posts, const DemOptions& options) {
  for (const float z : posts.heights.values())
    if (std::abs(z) > kMaxHeight)
      return fail(Errc::bad_data,
                  fmt::format("{}: a height of {} m is beyond {} m: what is the unit of z?",
                              posts.name, z, kMaxHeight));
  const std::vector<std::string> files = {posts.name};
  auto file = gdal::HeldFile::make(std::move(posts), options);
  if (!file) return std::unexpected(file.error());
  return RasterSource::of(gdal::Mosaic::of(std::move(*file)), gdal::Pool::of(options), files, {},
                          options);
}

}  // namespace tind
