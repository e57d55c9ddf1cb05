// LandXML 1.2. Its schema wants the date of writing; there is a fixed one, because the same mesh is
// the same bytes. Points are "northing easting elevation".

#include <cmath>

#include "proto/mesh/mesh_io.h"
#include "proto/text_put.h"

namespace tind::proto {
namespace {

constexpr double kSurveyFoot = 1200.0 / 3937;

bool is_near(double a, double b) { return std::abs(a - b) < 1e-9; }

/// LandXML's word for a linear unit; null where it has none.
const char* unit_name(double metres) {
  if (is_near(metres, 1)) return "meter";
  if (is_near(metres, kSurveyFoot)) return "USSurveyFoot";
  if (is_near(metres, 0.3048)) return "foot";
  return nullptr;
}

std::string units(const char* linear, double z_unit_m) {
  const bool metric = std::string_view(linear) == "meter";
  const char* const elevation = is_near(z_unit_m, 1) ? "meter" : "feet";
  return std::string("<Units><") + (metric ? "Metric" : "Imperial") + " linearUnit=\"" + linear +
         "\" areaUnit=\"" + (metric ? "squareMeter" : "squareFoot") + "\" volumeUnit=\"" +
         (metric ? "cubicMeter" : "cubicFeet") + "\" temperatureUnit=\"" +
         (metric ? "celsius" : "fahrenheit") + "\" pressureUnit=\"" + (metric ? "HPA" : "inHG") +
         "\" elevationUnit=\"" + elevation + "\"/></Units>\n";
}

std::string coordinate_system(const MeshPlace& place) {
  std::string out = "<CoordinateSystem desc=\"";
  std::string desc;
  for (const std::string& line : place_lines(place)) desc += (desc.empty() ? "" : "; ") + line;
  out += text::xml_text(desc) + "\"";
  if (place.epsg > 0 && !place.local) out += " epsgCode=\"" + std::to_string(place.epsg) + "\"";
  if (!place.crs_wkt.empty() && !place.local)
    out += " ogcWktCode=\"" + text::xml_text(place.crs_wkt) + "\"";
  if (!place.crs_name.empty() && !place.local)
    out += " horizontalCoordinateSystemName=\"" + text::xml_text(place.crs_name) + "\"";
  if (!place.vertical_datum.empty())
    out += " verticalDatum=\"" + text::xml_text(place.vertical_datum) + "\"";
  return out + "/>\n";
}

}  // namespace

Result<void> landxml_can_say(const MeshPlace& place) {
  if (place.geographic && !place.local)
    return fail(Errc::invalid_argument,
                "LandXML has metres and feet, not degrees: give --frame metric, or reproject the "
                "DEM with gdalwarp");
  if (!unit_name(place.local ? 1 : place.unit_m) || !unit_name(place.z_unit_m))
    return fail(Errc::invalid_argument,
                "LandXML has metres and feet only: give --frame metric and --units metres");
  // It has one word for heights in feet, and which foot that is the linear unit says.
  const bool survey = is_near(place.local ? 1 : place.unit_m, kSurveyFoot);
  if (!is_near(place.z_unit_m, 1) && is_near(place.z_unit_m, kSurveyFoot) != survey)
    return fail(Errc::invalid_argument,
                "LandXML cannot have heights in another foot than x and y: give --units metres");
  return {};
}

Result<std::string> encode_landxml(const Mesh& m) {
  const MeshPlace& place = m.place;
  if (const auto ok = landxml_can_say(place); !ok) return std::unexpected(ok.error());
  const char* const linear = unit_name(place.local ? 1 : place.unit_m);
  std::string out =
      "<?xml version=\"1.0\"?>\n<LandXML xmlns=\"http://www.landxml.org/schema/LandXML-1.2\" "
      "version=\"1.2\" date=\"1970-01-01\" time=\"00:00:00\" readOnly=\"false\" "
      "language=\"English\">\n" +
      units(linear, place.z_unit_m) + coordinate_system(place) +
      "<Application name=\"tind\"/>\n<Surfaces><Surface name=\"tind\"><Definition "
      "surfType=\"TIN\">\n<Pnts>\n";
  out.reserve(out.size() + m.positions.size() * 72 + m.triangles.size() * 36);
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    text::put_text(out += "<P id=\"", i + 1);
    const auto& [x, y, z] = m.positions[i];
    text::put_text(out += "\">", y);
    text::put_text(out += ' ', x);
    text::put_text(out += ' ', z);
    out += "</P>\n";
  }
  out += "</Pnts>\n<Faces>\n";
  for (const auto& [a, b, c] : m.triangles) {
    text::put_text(out += "<F>", a + 1);
    text::put_text(out += ' ', b + 1);
    text::put_text(out += ' ', c + 1);
    out += "</F>\n";
  }
  return out + "</Faces>\n</Definition></Surface></Surfaces>\n</LandXML>\n";
}

}  // namespace tind::proto
