// LandXML's surfaces, read as a stream of tags by expat. Numbers of points hold inside their
// surface; faces may name any of it. Nothing of a file stands elsewhere: one with entities of its
// own, or with a part in another file, is refused, for expat leaves out what it does not read, and
// 14&z; would be 14.

#include <expat.h>

#include <algorithm>
#include <memory>
#include <unordered_map>
#include <utility>

#include "proto/mesh/mesh_io.h"
#include "proto/mesh/mesh_quad.h"
#include "proto/text_scan.h"
#include "terrain/base/keyed_hash.h"

namespace tind::proto {
namespace {

class LandXmlReader {
 public:
  Result<Mesh> read(std::string_view bytes) {
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
        XML_ParserCreate(nullptr), &XML_ParserFree);
    if (!parser) return fail(Errc::internal, "no memory for an XML parser");
    parser_ = parser.get();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, on_start, on_end);
    XML_SetCharacterDataHandler(parser_, on_text);
    XML_SetEntityDeclHandler(parser_, on_entity);
    XML_SetNotStandaloneHandler(parser_, on_other_file);
    // expat counts with int; and parts as large as may be, as it begins a token that spans several
    // again with each of them.
    constexpr std::size_t kPart = 1 << 30;
    for (std::size_t at = 0; at < bytes.size() || at == 0; at += kPart) {
      const std::string_view part = bytes.substr(at, kPart);
      const bool last = at + kPart >= bytes.size();
      if (XML_Parse(parser_, part.data(), int(part.size()), last) != XML_STATUS_OK) break;
    }
    if (!why_.empty()) return bad(why_);
    if (XML_GetErrorCode(parser_) != XML_ERROR_NONE)
      return bad(XML_ErrorString(XML_GetErrorCode(parser_)));
    if (!is_landxml_) return fail(Errc::bad_data, "XML, but not LandXML");
    if (mesh_.triangles.empty()) return fail(Errc::bad_data, "LandXML without the faces of a TIN");
    return std::move(mesh_);
  }

 private:
  std::unexpected<Error> bad(const std::string& why) const {
    return fail(Errc::bad_data,
                "LandXML line " + std::to_string(XML_GetCurrentLineNumber(parser_)) + ": " + why);
  }

  void reject(std::string why) {
    if (!why_.empty()) return;
    why_ = std::move(why);
    XML_StopParser(parser_, XML_FALSE);
  }

  static const char* attribute(const char** attributes, std::string_view name) {
    for (; *attributes; attributes += 2)
      if (attributes[0] == name) return attributes[1];
    return "";
  }

  static void on_start(void* self, const char* name, const char** attributes) {
    static_cast<LandXmlReader*>(self)->start(name, attributes);
  }
  static void on_end(void* self, const char* name) { static_cast<LandXmlReader*>(self)->end(name); }
  static void on_text(void* self, const char* text, int size) {
    auto& reader = *static_cast<LandXmlReader*>(self);
    if ((reader.in_point_ || reader.in_face_) && reader.within_ == 0)
      reader.text_.append(text, std::size_t(size));
  }

  static void on_entity(void* self, const char*, int, const char*, int, const char*, const char*,
                        const char*, const char*) {
    static_cast<LandXmlReader*>(self)->reject(
        "its DOCTYPE declares entities, which are not read: write out what they stand for");
  }
  static int on_other_file(void* self) {
    static_cast<LandXmlReader*>(self)->reject(
        "its DOCTYPE leads to another file, which is not read: leave the DOCTYPE out");
    return XML_STATUS_ERROR;
  }

  /// Without a namespace's prefix.
  static std::string_view local_name(std::string_view name) {
    return name.substr(name.rfind(':') + 1);
  }

  void start(std::string_view full_name, const char** attributes) {
    if (++depth_ > kMostDepth) return reject("elements within elements more than 1000 deep");
    if (in_point_ || in_face_) {  // of somebody else: <P id="1">1 2 3<Feature/></P>
      ++within_;
      return;
    }
    const std::string_view name = local_name(full_name);
    if (name == "LandXML") is_landxml_ = true;
    if (name == "Metric" || name == "Imperial") units(attributes);
    if (name == "CoordinateSystem") coordinate_system(attributes);
    if (name == "Surface") {
      number_.clear(), named_.clear();
      surface_ = attribute(attributes, "name");
    }
    if (name == "Pnts") in_points_ = true;
    if (name == "Faces") in_faces_ = true;
    in_point_ = in_points_ && name == "P";
    in_face_ = in_faces_ && name == "F" && std::string_view(attribute(attributes, "i")) != "1";
    text_.clear();
    if (in_point_ && !text::parse(std::string_view(attribute(attributes, "id")), id_))
      reject("a point without a number");
  }

  void end(std::string_view full_name) {
    --depth_;
    if (within_ > 0) {
      --within_;
      return;
    }
    const std::string_view name = local_name(full_name);
    if (name == "P" && in_point_) point();
    if (name == "F" && in_face_) face();
    if (name == "Pnts") in_points_ = false;
    if (name == "Faces") in_faces_ = false;
    if (name == "Surface") finish_surface();
    in_point_ = in_face_ = false;
  }

  /// Metres per unit of that name; 0: no name of a length.
  static double metres_per(std::string_view unit) {
    constexpr std::pair<std::string_view, double> kUnits[] = {
        {"meter", 1},        {"millimeter", .001},
        {"centimeter", .01}, {"kilometer", 1000},
        {"foot", .3048},     {"feet", .3048},
        {"inch", .0254},     {"mile", 1609.344},
        {"miles", 1609.344}, {"USSurveyFoot", 1200.0 / 3937}};
    for (const auto& [name, metres] : kUnits)
      if (unit == name) return metres;
    return 0;
  }

  void units(const char** attributes) {
    const std::string_view across = attribute(attributes, "linearUnit");
    const std::string_view up = attribute(attributes, "elevationUnit");
    const double metres = metres_per(across);
    if (metres == 0) return reject("a linear unit that LandXML does not have");
    mesh_.place.unit_m = mesh_.place.said_unit_m = mesh_.place.z_unit_m = metres;
    if (up.empty() || (up == "feet" && across == "USSurveyFoot")) return;  // its feet
    mesh_.place.z_unit_m = metres_per(up);
    if (mesh_.place.z_unit_m == 0) reject("an elevation unit that LandXML does not have");
  }

  void coordinate_system(const char** attributes) {
    MeshPlace& place = mesh_.place;
    std::string_view lines = attribute(attributes, "desc");
    while (!lines.empty()) {
      const std::size_t end = std::min(lines.find("; "), lines.size());
      read_place_line(lines.substr(0, end), place);
      lines.remove_prefix(std::min(end + 2, lines.size()));
    }
    int epsg = 0;
    if (text::parse(std::string_view(attribute(attributes, "epsgCode")), epsg) && epsg > 0)
      place.epsg = epsg;
    if (const char* const wkt = attribute(attributes, "ogcWktCode"); *wkt) place.crs_wkt = wkt;
    if (const char* const datum = attribute(attributes, "verticalDatum"); *datum)
      place.vertical_datum = datum;
  }

  void point() {
    std::string_view rest = text_;
    double n[3];
    for (double& x : n)
      if (!text::parse_finite(text::take_word(rest), x))
        return reject("a point needs three finite numbers");
    if (!number_.try_emplace(id_, std::uint32_t(mesh_.positions.size())).second)
      return reject("there is a point " + std::to_string(id_) + " already");
    mesh_.positions.push_back({n[1], n[0], n[2]});
  }

  void face() {
    std::string_view rest = text_;
    std::array<std::uint64_t, 4> ids{};
    for (std::size_t i = 0; i < 3; ++i)
      if (!text::parse(text::take_word(rest), ids[i])) return reject("a face needs three points");
    ids[3] = ids[2];
    if (const auto fourth = text::take_word(rest); !fourth.empty() && !text::parse(fourth, ids[3]))
      return reject("a face names something that is no point");
    if (!text::trim(rest).empty()) return reject("a face of more than four points");
    named_.push_back(ids);
  }

  void finish_surface() {
    if (!named_.empty()) mesh_.surfaces.push_back(std::move(surface_));
    for (const auto& ids : named_) {
      std::array<std::uint32_t, 4> q{};
      for (std::size_t i = 0; i < 4; ++i) {
        const auto at = number_.find(ids[i]);
        if (at == number_.end())
          return reject("a face names point " + std::to_string(ids[i]) + ", which is not there");
        q[i] = at->second;
      }
      if (ids[2] == ids[3])
        mesh_.triangles.push_back(turned_up({q[0], q[1], q[2]}));
      else
        for (const auto& t : split_quad(mesh_.positions, q))
          mesh_.triangles.push_back(turned_up(t));
    }
    named_.clear();
  }

  /// LandXML does not say which way round a face goes, and programs differ: here, as seen
  /// from above.
  std::array<std::uint32_t, 3> turned_up(std::array<std::uint32_t, 3> t) const {
    const auto &a = mesh_.positions[t[0]], &b = mesh_.positions[t[1]], &c = mesh_.positions[t[2]];
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (area < 0) std::swap(t[1], t[2]);
    return t;
  }

  XML_Parser parser_ = nullptr;
  Mesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t, KeyedHash>
      number_;                                       // of the surface that is read
  std::vector<std::array<std::uint64_t, 4>> named_;  // a triangle has its last corner twice
  std::string text_, why_, surface_;
  std::uint64_t id_ = 0;
  static constexpr int kMostDepth = 1000;
  int depth_ = 0;
  int within_ = 0;  // elements open inside a point or a face
  bool is_landxml_ = false, in_points_ = false, in_faces_ = false;
  bool in_point_ = false, in_face_ = false;
};

}  // namespace

Result<Mesh> decode_landxml(std::string_view bytes) { return LandXmlReader().read(bytes); }

}  // namespace tind::proto
