// A page without scripts: inline SVG for the curves, PNG data URIs for the pictures, one stylesheet
// that also prints.

#include "server/cli/pictures/compare_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "server/cli/pictures/colours.h"
#include "terrain/mesh/scan_triangle.h"

namespace tind::cli {

namespace {

constexpr Pixel kPaper = {255, 255, 255};
/// Told apart by most readers with colour blindness (after Okabe and Ito).
constexpr const char* kInk[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                "#e69f00", "#56b4e9", "#000000", "#8a6d3b"};

/// Calls f(x, y, height, triangle) for every pixel (every step-th post) that the mesh covers.
template <class F>
void rasterise(const Tin& tin, int width, int height, int step, F&& f) {
  const double s = 1.0 / step;
  auto small = [&](const Vec3& v) { return Vec3{v.x * s, v.y * s, v.z}; };
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    const Triangle& c = tin.triangles[t];
    scan_triangle(small(tin.vertices[c[0]]), small(tin.vertices[c[1]]), small(tin.vertices[c[2]]),
                  0, height, width, [&](const PostSpan& span) {
                    for (int x = span.first; x <= span.last; ++x) f(x, span.row, span.height(x), t);
                    return true;
                  });
  }
}

int pixels(int posts, int step) { return (posts + step - 1) / step; }

std::pair<double, double> height_range(const HeightGrid& grid) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const float z : grid.values())
    if (!std::isnan(z)) low = std::min(low, double(z)), high = std::max(high, double(z));
  return {low, high};
}

// ---- curves ----

struct Axis {
  double low, high;  // logarithms
  double from, to;   // on the page
  double at(double v) const { return from + (std::log10(v) - low) / (high - low) * (to - from); }
};

Axis axis(const std::vector<double>& values, double from, double to) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double v : values)
    if (v > 0) low = std::min(low, std::log10(v)), high = std::max(high, std::log10(v));
  if (!(low <= high)) low = 0, high = 1;
  const double pad = std::max(0.08, 0.06 * (high - low));
  return {low - pad, high + pad, from, to};
}

std::string number(double v) {
  if (v >= 1e6) return fmt::format("{:g}M", v / 1e6);
  if (v >= 1e4) return fmt::format("{:g}k", v / 1e3);
  return fmt::format("{:g}", v);
}

/// 1, 2 and 5 of each decade.
std::vector<double> ticks(const Axis& a) {
  std::vector<double> out;
  const bool many = a.high - a.low > 2.5;
  for (int decade = int(std::floor(a.low)); decade <= int(std::ceil(a.high)); ++decade) {
    for (const double m : {1.0, 2.0, 5.0}) {
      const double v = m * std::pow(10.0, decade);
      const double l = std::log10(v);
      if (l >= a.low && l <= a.high && (m == 1 || !many)) out.push_back(v);
    }
  }
  return out;
}

std::vector<std::string> methods_of(const std::vector<CompareRow>& rows) {
  std::vector<std::string> names;
  for (const CompareRow& r : rows)
    if (std::ranges::find(names, r.method) == names.end()) names.push_back(r.method);
  return names;
}

const char* ink(std::size_t i) { return kInk[i % std::size(kInk)]; }

std::string curve(const std::vector<CompareRow>& rows, const std::string& title,
                  const std::function<double(const CompareRow&)>& value) {
  constexpr double kWidth = 430, kHeight = 300;
  std::vector<double> xs, ys;
  for (const CompareRow& r : rows) {
    if (!r.failure.empty()) continue;
    xs.push_back(double(r.quality.triangles));
    ys.push_back(value(r));
  }
  const Axis x = axis(xs, 58, kWidth - 14), y = axis(ys, kHeight - 44, 30);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" role=\"img\" aria-label=\"{2}\"><text x=\"58\" y=\"16\" "
      "class=\"title\">{2}</text>\n",
      kWidth, kHeight, title);
  for (const double v : ticks(x)) {
    svg += fmt::format(
        "<path d=\"M{0:.1f} 30V{1}\" class=\"grid\"/><text x=\"{0:.1f}\" y=\"{2}\" "
        "text-anchor=\"middle\">{3}</text>\n",
        x.at(v), kHeight - 44, kHeight - 28, number(v));
  }
  for (const double v : ticks(y)) {
    svg += fmt::format(
        "<path d=\"M58 {0:.1f}H{1}\" class=\"grid\"/><text x=\"52\" y=\"{2:.1f}\" "
        "text-anchor=\"end\">{3}</text>\n",
        y.at(v), kWidth - 14, y.at(v) + 4, number(v));
  }
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">triangles</text>\n",
                     (58 + kWidth - 14) / 2, kHeight - 8);
  const std::vector<std::string> names = methods_of(rows);
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<std::pair<double, double>> points;
    for (const CompareRow& r : rows)
      if (r.method == names[i] && r.failure.empty() && value(r) > 0)
        points.push_back({x.at(double(r.quality.triangles)), y.at(value(r))});
    std::ranges::sort(points);
    std::string path;
    for (const auto& [px, py] : points)
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", px, py);
    svg += fmt::format("<path d=\"{}\" stroke=\"{}\" class=\"line\"/>", path, ink(i));
    for (const auto& [px, py] : points)
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>", px, py,
                         ink(i));
    svg += "\n";
  }
  return svg + "</svg>\n";
}

std::string key(const std::vector<CompareRow>& rows) {
  std::string out = "<p class=\"key\">";
  const std::vector<std::string> names = methods_of(rows);
  for (std::size_t i = 0; i < names.size(); ++i)
    out += fmt::format("<span><i style=\"background:{}\"></i>{}</span>", ink(i), names[i]);
  return out + "</p>\n";
}

// ---- table and pictures ----

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string table(const std::vector<CompareRow>& rows) {
  std::string out =
      "<table><thead><tr><th>method<th>stop<th>triangles<th>steps<th>RMS, m<th>max, m<th>95 %, "
      "m<th>99 %, m<th>flipped<th>uncovered<th>time, s<th>peak, MB</thead><tbody>\n";
  for (const CompareRow& r : rows) {
    out += fmt::format("<tr><td>{}<td>{}", escape(r.method), escape(r.stop));
    if (!r.failure.empty()) {
      out += fmt::format("<td colspan=\"10\" class=\"why\">{}\n", escape(r.failure));
      continue;
    }
    const VerticalError& e = r.quality.error;
    out += fmt::format(
        "<td>{}<td>{}<td>{:.3f}<td>{:.2f}<td>{:.2f}<td>{:.2f}<td>{}<td>{}<td>{:.3f}<td>{:.0f}\n",
        r.quality.triangles, r.made.steps, e.rms_m, e.max_m, e.p95_m, e.p99_m, r.quality.flipped,
        r.quality.uncovered, r.seconds, r.peak_mb);
  }
  return out + "</tbody></table>\n";
}

std::string legend(double scale) {
  std::string stops;
  for (int i = 0; i <= 20; ++i) {
    const Pixel p = difference(i / 10.0 - 1);
    stops +=
        fmt::format("<stop offset=\"{}%\" stop-color=\"rgb({},{},{})\"/>", 5 * i, p[0], p[1], p[2]);
  }
  return fmt::format(
      "<svg viewBox=\"-16 0 392 40\" class=\"legend\"><defs><linearGradient id=\"e\">{}"
      "</linearGradient></defs><rect x=\"20\" y=\"4\" width=\"320\" height=\"14\" fill=\"url(#e)\" "
      "stroke=\"#999\" stroke-width=\".5\"/><text x=\"20\" y=\"34\" text-anchor=\"middle\">−{:.3g} "
      "m"
      "</text><text x=\"180\" y=\"34\" text-anchor=\"middle\">mesh below · as the DEM · "
      "above</text>"
      "<text x=\"340\" y=\"34\" text-anchor=\"middle\">+{:.3g} m</text></svg>\n",
      stops, scale, scale);
}

std::vector<std::string> stops_of(const std::vector<CompareRow>& rows) {
  std::vector<std::string> stops;
  for (const CompareRow& r : rows)
    if (std::ranges::find(stops, r.stop) == stops.end()) stops.push_back(r.stop);
  return stops;
}

/// All results at one stop, with one scale of errors: the middle one of their 99 % errors, so that
/// neither the best method's picture is blank nor the worst one's saturated all over.
std::string pictures(const std::vector<CompareRow>& rows, const std::string& stop,
                     const Terrain& dem, int step) {
  std::vector<double> p99;
  for (const CompareRow& r : rows)
    if (r.failure.empty() && r.stop == stop) p99.push_back(r.quality.error.p99_m);
  if (p99.empty()) return "";
  std::ranges::sort(p99);
  const double scale = std::max(1e-3, p99[p99.size() / 2]);
  std::string out =
      fmt::format("<h2>Results and their errors at {}</h2>\n{}<div class=\"pictures\">\n",
                  escape(stop), legend(scale));
  for (const CompareRow& r : rows) {
    if (!r.failure.empty() || r.stop != stop) continue;
    out += fmt::format(
        "<figure><div><img alt=\"shaded mesh\" src=\"{}\"><img alt=\"error\" src=\"{}\"></div>"
        "<figcaption><b>{}</b>: {} triangles, RMS {:.2f} m, max {:.1f} m</figcaption></figure>\n",
        png_data_uri(shaded(r.made.tin, dem, step)),
        png_data_uri(error_picture(r.made.tin, dem.grid, scale, step)), escape(r.method),
        r.quality.triangles, r.quality.error.rms_m, r.quality.error.max_m);
  }
  return out + "</div>\n";
}

constexpr const char* kStyle = R"(
:root { color-scheme: light }
body { font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1c2430;
       background: #fff; max-width: 1360px; margin: 2.5rem auto; padding: 0 1.5rem }
h1 { font-size: 1.6rem; font-weight: 600; margin: 0 0 .2rem }
h2 { font-size: 1.1rem; font-weight: 600; margin: 2.4rem 0 .6rem }
.lead { color: #566; margin: 0 0 1.2rem }
.curves { display: grid; grid-template-columns: repeat(auto-fit, minmax(340px, 1fr)); gap: 1rem }
svg text { font-size: 11.5px; fill: #455 } svg .title { font-size: 13px; font-weight: 600; fill: #1c2430 }
.grid { stroke: #e3e7ea; stroke-width: 1; fill: none } .line { fill: none; stroke-width: 2 }
.key span { margin-right: 1.4rem; white-space: nowrap } .key i { display: inline-block; width: 1.1em;
       height: .28em; margin-right: .45em; vertical-align: middle; border-radius: 2px }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px }
th { text-align: right; font-weight: 600; border-bottom: 2px solid #1c2430; padding: .35rem .6rem }
td { text-align: right; border-bottom: 1px solid #e3e7ea; padding: .3rem .6rem }
th:nth-child(-n+2), td:nth-child(-n+2), td.why { text-align: left }
td.why { color: #a33 }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(380px, 1fr)); gap: 1.6rem 1rem }
figure { margin: 0; break-inside: avoid } figure div { display: grid; grid-template-columns: 1fr 1fr; gap: 4px }
img { width: 100%; display: block; border: 1px solid #d5dadd }
figcaption { font-size: 13px; color: #455; margin-top: .35rem } figcaption b { color: #1c2430 }
.legend { width: 392px; display: block; margin: .2rem 0 1rem }
@media print { body { margin: 0; max-width: none } h2 { break-after: avoid } }
)";

}  // namespace

Picture shaded(const Tin& tin, const Terrain& dem, int step) {
  const HeightGrid& grid = dem.grid;
  const auto [low, high] = height_range(grid);
  const double range = std::max(1e-9, high - low);
  std::vector<double> light;
  light.reserve(tin.triangles.size());
  for (const Triangle& t : tin.triangles) {
    auto metric = [&](int k) {
      const Vec3& v = tin.vertices[t[k]];
      return Vec3{v.x * dem.spacing_x_m, v.y * dem.spacing_y_m, v.z};
    };
    const Vec3 a = metric(0), n = cross(metric(1) - a, metric(2) - a);
    light.push_back(light_on(n));
  }
  Picture picture(pixels(grid.cols(), step), pixels(grid.rows(), step), kPaper);
  rasterise(tin, picture.width, picture.height, step, [&](int x, int y, double z, std::size_t t) {
    // Where a pixel has a triangle, there is one.
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference)
    picture.at(x, y) = lit(land((z - low) / range), light[t]);
  });
  return picture;
}

Picture error_picture(const Tin& tin, const HeightGrid& grid, double scale, int step) {
  Picture picture(pixels(grid.cols(), step), pixels(grid.rows(), step), kPaper);
  rasterise(tin, picture.width, picture.height, step, [&](int x, int y, double z, std::size_t) {
    const float post = grid.at(x * step, y * step);
    if (!std::isnan(post)) picture.at(x, y) = difference((z - double(post)) / scale);
  });
  return picture;
}

std::string compare_page(const std::string& title, const std::vector<CompareRow>& rows,
                         const Terrain& dem) {
  const HeightGrid& grid = dem.grid;
  const int step = std::max(1, (std::max(grid.cols(), grid.rows()) + 599) / 600);
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title><style>{1}</style>\n<h1>{0}</h1>\n"
      "<p class=\"lead\">{2} × {3} posts, {4:.4g} × {5:.4g} m apart. Errors are vertical, in "
      "metres, "
      "of each mesh against every valid post.</p>\n",
      escape(title), kStyle, grid.cols(), grid.rows(), dem.spacing_x_m, dem.spacing_y_m);
  page += key(rows);
  page += "<div class=\"curves\">\n";
  page += curve(rows, "RMS error, m", [](const CompareRow& r) { return r.quality.error.rms_m; });
  page +=
      curve(rows, "Maximum error, m", [](const CompareRow& r) { return r.quality.error.max_m; });
  page += curve(rows, "Time, s", [](const CompareRow& r) { return r.seconds; });
  page += "</div>\n<h2>Figures</h2>\n" + table(rows);
  for (const std::string& stop : stops_of(rows)) page += pictures(rows, stop, dem, step);
  return page + "</html>\n";
}

}  // namespace tind::cli
