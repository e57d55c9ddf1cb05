#include "server/api/ogc/coverage_query.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "server/api/crs_name.h"
#include "server/api/elevation/heights.h"
#include "server/http/message/media_choice.h"
#include "server/http/message/query_numbers.h"
#include "terrain/raster/dem_window.h"

namespace tind::api::ogc {
namespace {

using Wrong = http::ParameterProblem;

bool anything(std::string_view) { return true; }

constexpr double kMostAcross = 1 << 16;  // pixels along one side
const http::QueryNumber kNumbers[] = {{"width", 1, kMostAcross, "pixels", true},
                                      {"height", 1, kMostAcross, "pixels", true}};

std::vector<http::QueryWord> words() {
  return {{"f", {"tif", "png", "asc", "covjson"}},
          {.name = "bbox",
           .words = {},
           .fits = anything,
           .form = "four numbers in bbox-crs",
           .pattern = "^-121\\.[7-9],46\\.[78],-121\\.[56],46\\.9$",
           .example = "-121.78,46.84,-121.74,46.87"},
          {"bbox-crs", {"CRS84"}, is_crs_name, kCrsForm},
          {"crs", {"CRS84"}, is_crs_name, kCrsForm},
          {.name = "subset",
           .words = {},
           .fits = anything,
           .form = "Lon(7:8),Lat(46:47)",
           .about = "in place of bbox",
           .pattern = "^Lon\\(-121\\.[89]:-121\\.[67]\\)$"},
          {.name = "scale-size",
           .words = {},
           .fits = anything,
           .form = "Lon(512),Lat(256)",
           .about = "in place of width and height",
           .pattern = "^Lon\\([1-9][0-9]\\)$"},
          {.name = "scaleSize",
           .words = {},
           .fits = anything,
           .form = "as scale-size",
           .pattern = "^Lon\\([1-9][0-9]\\)$"},
          height_words()[0]};  // datum
}

/// 'x', 'y', or 0 for what is the name of neither.
char axis_of(std::string_view name) {
  std::string small(name);
  for (char& c : small)
    if (c >= 'A' && c <= 'Z') c = char(c + 32);
  for (const char* x : {"lon", "long", "e", "x"})
    if (small == x) return 'x';
  for (const char* y : {"lat", "n", "y"})
    if (small == y) return 'y';
  return 0;
}

/// f(axis, text in brackets) of each part of "Lon(7:8),Lat(46:47)"; false where it is none.
template <class F>
bool each_axis(std::string_view text, const F& f) {
  while (!text.empty()) {
    const std::size_t open = text.find('('), close = text.find(')');
    if (open == text.npos || close == text.npos || close < open) return false;
    const char axis = axis_of(text.substr(0, open));
    if (axis == 0 || !f(axis, text.substr(open + 1, close - open - 1))) return false;
    text.remove_prefix(close + 1);
    if (text.empty()) return true;
    if (!text.starts_with(',')) return false;
    text.remove_prefix(1);
  }
  return false;
}

template <class Number>
bool read_all(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool read_subset(std::string_view text, CoverageQuery& q) {
  return each_axis(text, [&](char axis, std::string_view range) {
    const std::size_t colon = range.find(':');
    std::pair<double, double> ends;
    if (colon == range.npos || !read_all(range.substr(0, colon), ends.first) ||
        !read_all(range.substr(colon + 1), ends.second) || !(ends.first < ends.second) ||
        !std::isfinite(ends.first) || !std::isfinite(ends.second))
      return false;
    auto& subset = axis == 'x' ? q.subset_x : q.subset_y;
    if (subset) return false;  // said twice
    subset = ends;
    return true;
  });
}

bool read_scale(std::string_view text, CoverageQuery& q) {
  return each_axis(text, [&](char axis, std::string_view pixels) {
    int& side = axis == 'x' ? q.width : q.height;
    return side == 0 && read_all(pixels, side) && side >= 1 && side <= int(kMostAcross);
  });
}

CoverageFormat format_of(const std::string& f, const http::Fields& fields) {
  if (const auto format = enum_named<CoverageFormat>(f)) return *format;
  constexpr std::string_view kTypes[] = {"image/tiff", "image/png", "text/plain",
                                         "application/prs.coverage+json"};
  return CoverageFormat(http::preferred_type(fields, kTypes).value_or(0));
}

void read_window(const http::QueryNumbers& read, CoverageQuery& q, std::vector<Wrong>& problems) {
  const std::string &bbox = read.words[1], &subset = read.words[4];
  if (!bbox.empty()) q.bbox = four_numbers(bbox);
  if (!bbox.empty() && !q.bbox)
    problems.push_back({"bbox", "must be four numbers with commas between"});
  if (!bbox.empty() && !subset.empty())
    problems.push_back({"subset", "and bbox name two windows: leave one out"});
  if (!subset.empty() && !read_subset(subset, q))
    problems.push_back({"subset", "must be as Lon(7:8),Lat(46:47)"});
}

void read_size(const http::QueryNumbers& read, CoverageQuery& q, std::vector<Wrong>& problems) {
  q.width = int(read.values[0].value_or(0)), q.height = int(read.values[1].value_or(0));
  for (const std::size_t k : {5, 6}) {
    if (read.words[k].empty()) continue;
    if (q.width > 0 || q.height > 0)
      problems.push_back({"scale-size", "and another size are two: leave one out"});
    else if (!read_scale(read.words[k], q))
      problems.push_back({"scale-size", "must be as Lon(512),Lat(256)"});
  }
}

/// The rectangle of the answer's system around another's.
std::expected<CrsBox, Wrong> window_in(const CrsBox& box, const AskedCrs& from,
                                       const AskedCrs& to) {
  if (const auto found = box_in(box, from, to)) return *found;
  return std::unexpected(Wrong{"bbox", "has no places in " + to.name()});
}

std::expected<CrsBox, Wrong> box_asked(const CoverageQuery& q, const AskedCrs& bbox_crs,
                                       const AskedCrs& crs, const DatasetFacts& facts,
                                       const PostGrid& bbox_grid, const PostGrid& grid) {
  if (q.bbox) {
    const auto box = bbox_crs.box(*q.bbox);
    if (!box) return std::unexpected(Wrong{"bbox", box.error().what});
    return window_in(*box, bbox_crs, crs);
  }
  const auto whole = [&](const AskedCrs& in, const PostGrid& posts,
                         const char* name) -> std::expected<CrsBox, Wrong> {
    const auto all = box_of(in, facts);
    if (!all) return std::unexpected(Wrong{name, all.error().what});
    return posts.around(in, *all);
  };
  if (!q.subset_x && !q.subset_y) return whole(crs, grid, "crs");
  auto box = whole(bbox_crs, bbox_grid, "bbox-crs");
  if (!box) return std::unexpected(box.error());
  if (q.subset_x) box->west = q.subset_x->first, box->east = q.subset_x->second;
  if (q.subset_y) box->south = q.subset_y->first, box->north = q.subset_y->second;
  if (!bbox_crs.is_on_globe(*box))
    return std::unexpected(Wrong{"subset", "must be longitudes and latitudes"});
  return window_in(*box, bbox_crs, crs);
}

/// Pixels along both sides; not whole, and perhaps too many.
Vec2 pixels_of(const CoverageQuery& q, const CrsBox& box, Vec2 ground, const PostGrid& grid) {
  if (q.width > 0 && q.height > 0) return {double(q.width), double(q.height)};
  if (q.width > 0) return {double(q.width), q.width * ground.y / ground.x};
  if (q.height > 0) return {q.height * ground.x / ground.y, double(q.height)};
  const Vec2 all = grid.pixels(box, ground);
  // As fine as the posts, or coarser in both directions alike.
  const double less = std::min(1., std::sqrt(kMostTextPixels / (all.x * all.y)));
  if (less == 1) return all;
  return {std::floor(all.x * less), std::floor(all.y * less)};
}

}  // namespace

std::expected<CoverageQuery, std::vector<http::ParameterProblem>> read_coverage_query(
    std::string_view query, const http::Fields& fields) {
  auto read = http::read_numbers(query, kNumbers, words());
  CoverageQuery q;
  read_window(read, q, read.problems);
  read_size(read, q, read.problems);
  if (!read.problems.empty()) return std::unexpected(std::move(read.problems));
  q.format = format_of(read.words[0], fields);
  if (!read.words[2].empty()) q.bbox_crs = *crs_named(read.words[2]);
  q.crs = read.words[3].empty() ? q.bbox_crs : *crs_named(read.words[3]);
  q.datum = read.words[7];
  return q;
}

std::expected<CoverageWindow, http::ParameterProblem> coverage_window(
    const CoverageQuery& q, const AskedCrs& bbox_crs, const AskedCrs& crs,
    const DatasetFacts& facts, const PostGrid& bbox_grid, const PostGrid& grid) {
  const auto box = box_asked(q, bbox_crs, crs, facts, bbox_grid, grid);
  if (!box) return std::unexpected(box.error());
  const Vec2 ground = ground_m(crs, *box);
  if (!(ground.x > 0 && ground.y > 0))
    return std::unexpected(Wrong{"bbox", "has no places in " + crs.name()});
  const Vec2 pixels = pixels_of(q, *box, ground, grid);
  const bool text = q.format == CoverageFormat::asc || q.format == CoverageFormat::covjson;
  const double most = text ? kMostTextPixels : kMostPixels;
  const double cols = std::max(1., std::round(pixels.x)), rows = std::max(1., std::round(pixels.y));
  if (cols * rows > most || std::max(cols, rows) > kMostAcross)
    return std::unexpected(Wrong{
        q.width > 0 ? "width" : "height",
        "makes more pixels than " + std::to_string(long(most)) + " of one answer in this format"});
  return CoverageWindow{*box, int(cols), int(rows), {ground.x / cols, ground.y / rows}};
}

std::optional<CoverageWindow> own_grid(const CoverageQuery& q, const AskedCrs& crs,
                                       const DemInfo& info) {
  const Affine& a = info.post_to_crs;
  const bool upright = a.x_row == 0 && a.y_col == 0;
  const bool all = !q.bbox && !q.subset_x && !q.subset_y && q.width == 0 && q.height == 0;
  if (!all || !upright || info.crs_kind != CrsKind::projected ||
      double(info.cols) * double(info.rows) > kMostTextPixels)
    return {};
  // Whichever way its rows and columns run, the answer's are from the north and the west.
  const double x = a.x0 - a.x_col / 2, y = a.y0 - a.y_row / 2;
  const double to_x = x + a.x_col * double(info.cols), to_y = y + a.y_row * double(info.rows);
  const CrsBox box{std::min(x, to_x), std::min(y, to_y), std::max(x, to_x), std::max(y, to_y)};
  const Vec2 ground = ground_m(crs, box);
  if (!(ground.x > 0 && ground.y > 0)) return {};
  return CoverageWindow{box,
                        int(info.cols),
                        int(info.rows),
                        {ground.x / double(info.cols), ground.y / double(info.rows)}};
}

http::Operation coverage_operation() {
  return {.id = "getCoverage",
          .tag = "OGC",
          .summary = "Heights of a window as a raster, in any system",
          .numbers = {std::begin(kNumbers), std::end(kNumbers)},
          .words = words(),
          .responses = {{200,
                         "The raster.",
                         {{"image/tiff"},
                          {"image/png"},
                          {"text/plain", R"({"type": "string"})"},
                          {"application/prs.coverage+json", R"({"type": "object"})"}}}}};
}

}  // namespace tind::api::ogc
