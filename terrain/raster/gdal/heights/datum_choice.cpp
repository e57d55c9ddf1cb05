#include "terrain/raster/gdal/heights/datum_choice.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace tind {
namespace {

/// "'EGM2008 height'", as the file names it; empty where it says nothing.
std::string stated_name(const gdal::FileFacts& facts) {
  if (!facts.crs.vertical.empty()) return "'" + facts.crs.vertical + "'";
  return facts.crs.datum == VerticalDatum::unknown ? std::string() : name(facts.crs.datum);
}

std::string name_of(const TargetDatum& target) {
  return target.kind == TargetDatum::datum ? name(target.named) : "the ellipsoid";
}

Result<void> unknown_source(const gdal::FileFacts& facts, const DemOptions& options,
                            DatumChoice& choice) {
  const std::string stated = stated_name(facts);
  const std::string why =
      stated.empty() ? facts.path + ": does not say what its heights are above"
                     : fmt::format("{}: its heights are above {}, which PROJ does not know",
                                   facts.path, stated);
  const std::string remedy =
      stated.empty()
          ? "say it with --from-datum egm96, egm2008, ellipsoid or a vertical CRS (EPSG:5703)"
          : "say with --from-datum which of PROJ's vertical CRSs, or which geoid file, that is";
  if (options.to_datum != TargetDatum::ellipsoid_if_known)
    return fail(Errc::invalid_argument,
                fmt::format("{}, so they cannot be brought to {}; {}, or leave --to-datum out", why,
                            name_of(options.to_datum), remedy));
  choice.warnings.push_back(why + "; they stay as they are, datum unknown (" + remedy + ")");
  return {};
}

/// A place of the bounds that the surface does not reach, among those of a lattice.
std::optional<Geographic> beyond(const DatumSurface& surface, const GeoRect& bounds) {
  constexpr int kSide = 9;
  std::vector<Geographic> places;
  places.reserve(std::size_t(kSide) * kSide);
  for (int row = 0; row < kSide; ++row)
    for (int col = 0; col < kSide; ++col)
      places.push_back({bounds.west + bounds.width() * col / (kSide - 1),
                        bounds.south + bounds.height() * row / (kSide - 1)});
  std::vector<double> undulations(places.size());
  surface.undulations(places, undulations);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (std::isnan(undulations[i])) return places[i];
  return {};
}

Result<void> find_surfaces(const gdal::FileFacts& facts, const GeoRect& bounds,
                           const VerticalDatum& target, const DemOptions& options,
                           DatumChoice& choice) {
  if (facts.crs.kind == CrsKind::none)
    return fail(Errc::invalid_argument,
                "has no CRS, so its heights cannot be brought to " + name_of(options.to_datum));
  if (!options.environment)
    return fail(Errc::invalid_argument,
                "to another datum only with an environment, which has the geoid");
  auto from = datum_surface(choice.source, bounds, facts.crs.wkt, *options.environment);
  if (!from) return std::unexpected(from.error());
  auto to = datum_surface(target, bounds, facts.crs.wkt, *options.environment);
  if (!to) return std::unexpected(to.error());
  choice.from = std::move(*from);
  choice.to = std::move(*to);
  choice.shifts = true;
  choice.result = target;
  for (const auto& surface : {choice.from, choice.to}) {
    if (!surface) continue;
    if (!surface->warning().empty())
      choice.warnings.push_back(facts.path + ": " + surface->warning());
    if (const auto where = beyond(*surface, bounds))
      choice.warnings.push_back(fmt::format(
          "{}: {} does not reach all of it (not longitude {:.4f}, latitude {:.4f}); a height there "
          "is an error",
          facts.path, surface->way(), where->lon, where->lat));
  }
  return {};
}

}  // namespace

std::string DatumChoice::way() const {
  std::string text = from ? from->way() : "";
  if (to) text += (text.empty() ? "" : "; then ") + to->way();
  return text;
}

std::string DatumChoice::identity() const {
  std::string text = from ? from->identity() : "";
  if (to) text += " to " + to->identity();
  return text;
}

Result<DatumChoice> choose_datum(const gdal::FileFacts& facts, const GeoRect& bounds,
                                 const DemOptions& options) {
  const VerticalDatum &said = options.from_datum, &stated = facts.crs.datum;
  DatumChoice choice;
  choice.source = choice.result = said != VerticalDatum::unknown ? said : stated;
  const std::string stated_text = stated_name(facts);
  if (said != VerticalDatum::unknown && !stated_text.empty() && said != stated) {
    choice.overruled = stated_text;
    choice.warnings.push_back(
        fmt::format("{}: says that its heights are above {}; they are taken as above {}, as "
                    "--from-datum says",
                    facts.path, stated_text, name(said)));
  }
  const bool wish = options.to_datum == TargetDatum::ellipsoid_if_known;
  const VerticalDatum target = options.to_datum.kind == TargetDatum::datum
                                   ? options.to_datum.named
                                   : VerticalDatum(VerticalDatum::ellipsoid);
  if (options.to_datum == TargetDatum::same || choice.source == target) return choice;
  if (choice.source == VerticalDatum::unknown) {
    if (auto ok = unknown_source(facts, options, choice); !ok) return std::unexpected(ok.error());
    return choice;
  }
  const auto found = find_surfaces(facts, bounds, target, options, choice);
  if (found) return choice;
  const bool may_stay = wish && said == VerticalDatum::unknown && stated != VerticalDatum::egm96 &&
                        found.error().code != Errc::bad_data && found.error().code != Errc::io;
  if (!may_stay) return fail(facts.path, found.error());
  choice.warnings.push_back(fmt::format("{}: {}; its heights stay as they are, above {}",
                                        facts.path, found.error().what, name(stated)));
  return choice;
}

}  // namespace tind
