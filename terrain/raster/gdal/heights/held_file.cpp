#include "terrain/raster/gdal/heights/held_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "terrain/base/bytes.h"
#include "terrain/base/hash.h"
#include "terrain/raster/crs_points.h"
#include "terrain/raster/gdal/gdal_setup.h"

namespace tind::gdal {

/// What --crs says counts before what the file does, as for rasters.
Result<void> HeldFile::learn_crs(const std::string& said, const VerticalDatum& datum,
                                 const DemOptions& options) {
  CrsFacts own;
  if (!said.empty()) {
    auto known = is_epsg_code(said) || said.find('[') != said.npos
                     ? crs_named(said)
                     : fail(Errc::bad_data, "it is neither WKT nor of EPSG's list");
    if (known && names_a_file(known->wkt)) known = fail(Errc::bad_data, "it names a file");
    // Whoever says what the CRS is need not mind what the file calls it.
    if (!known && options.crs.empty())
      return fail(known.error().code == Errc::io ? Errc::io : Errc::bad_data,
                  fmt::format("{}: says that its CRS is '{}', which cannot be used: {}; say with "
                              "--crs which one it is",
                              facts_.path, said, known.error().what));
    if (known) own = std::move(*known);
  }
  facts_.crs = own;
  if (!options.crs.empty()) {
    auto named = crs_named(options.crs);
    if (!named) return fail(facts_.path + ": --crs", named.error());
    facts_.crs = std::move(*named);
    if (own.kind != CrsKind::none && !same_crs(own.wkt, facts_.crs.wkt)) facts_.own_crs = own.name;
  }
  if (facts_.crs.datum == VerticalDatum::unknown && facts_.crs.vertical.empty())
    facts_.crs.datum = datum;
  return {};
}

Result<std::unique_ptr<HeightFile>> HeldFile::make(HeldPosts posts, const DemOptions& options) {
  set_up();
  std::unique_ptr<HeldFile> file(new HeldFile(std::move(posts.heights)));
  FileFacts& facts = file->facts_;
  facts.path = std::move(posts.name);
  facts.driver = std::move(posts.kind);
  facts.cols = file->heights_.cols(), facts.rows = file->heights_.rows();
  facts.has_geotransform = true;
  facts.post_to_crs = posts.post_to_crs;
  facts.exact = false;  // they were rounded to floats by whoever computed them
  facts.content.type = "Float32";
  if (auto ok = file->learn_crs(posts.crs, posts.datum, options); !ok)
    return std::unexpected(ok.error());
  return file;
}

Result<void> HeldFile::read(int col, int row, int cols, int rows, std::span<double> out) const {
  for (int r = 0; r < rows; ++r)
    std::ranges::copy(heights_.row(row + r).subspan(std::size_t(col), std::size_t(cols)),
                      out.begin() + std::ptrdiff_t(r) * cols);
  return {};
}

Result<void> HeldFile::read_posts(std::span<const Post> posts) const {
  for (const Post& p : posts) *p.height = double(heights_.at(p.col, p.row));
  return {};
}

Result<std::string> HeldFile::fingerprint() const {
  const Affine& a = facts_.post_to_crs;
  return fmt::format(
      "{} {} {} {} {} {} {} {} {}\n", a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row, facts_.cols,
      facts_.rows,
      hash128(ByteView(heights_.values().data(), heights_.size() * sizeof(float))).text());
}

}  // namespace tind::gdal
