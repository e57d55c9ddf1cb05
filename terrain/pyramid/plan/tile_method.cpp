#include "terrain/pyramid/plan/tile_method.h"

#include "terrain/raster/image_colours.h"
#include "terrain/simplify/method_text.h"
#include "terrain/simplify/methods.h"

namespace tind {

namespace {

std::string names_of_tile_methods() {
  std::string all;
  for (const MethodInfo& m : methods())
    if (m.tiles) all += (all.empty() ? "" : ", ") + m.name;
  return all;
}

}  // namespace

Result<void> check_tile_method(const MethodOptions& method) {
  const std::string name = method_name(method);
  for (const MethodInfo& m : methods()) {
    if (m.name != name || m.tiles) continue;
    return fail(Errc::invalid_argument,
                name + " cannot hold the borders of tiles; these can: " + names_of_tile_methods());
  }
  if (const auto* const attributed = std::get_if<AttributeQemOptions>(&method)) {
    if (attributed->drape || attributed->attributes == AttributeChoice::texture)
      return fail(Errc::invalid_argument,
                  "tiles have no texture coordinates: attribute-qem makes them with attributes "
                  "auto, normal, colour or colour+normal");
  }
  return check_options(method);
}

Result<MethodOptions> tile_method_from_text(const std::string& text) {
  Result<MethodOptions> method = method_from_text(text);
  if (!method) return method;
  if (const auto ok = check_tile_method(*method); !ok) return std::unexpected(ok.error());
  if (std::holds_alternative<BoundedOptions>(*method) && text != BoundedOptions::kName)
    return fail(Errc::invalid_argument,
                "effort and side are settings of their own: the method is 'bounded' alone");
  return method;
}

std::shared_ptr<const ImageColours> counted_colours(const TileSetOptions& o) {
  const auto* const by = std::get_if<AttributeQemOptions>(&o.method);
  if (!by || by->attributes == AttributeChoice::normal || by->metric == AttributeMetric::ignored)
    return nullptr;
  return o.colours;
}

Result<void> check_tile_colours(const TileSetOptions& o, const GeoRect& bounds) {
  const auto* const by = std::get_if<AttributeQemOptions>(&o.method);
  if (by && !o.colours &&
      (by->attributes == AttributeChoice::colour ||
       by->attributes == AttributeChoice::colour_and_normal))
    return fail(Errc::invalid_argument,
                "attribute-qem with attributes " + name_of(by->attributes) +
                    " needs an image to go by: --drape with --format 3dtiles, or drape in the "
                    "dataset's table");
  const auto colours = counted_colours(o);
  if (colours && !colours->bounds().overlaps(bounds))
    return fail(Errc::invalid_argument,
                "the image that is draped lies elsewhere: attribute-qem has no colours to go by");
  return {};
}

std::string drape_fingerprint(const TileSetOptions& o) {
  const auto colours = counted_colours(o);
  return colours ? colours->fingerprint() : std::string();
}

std::string tile_method(const TileSetOptions& o) {
  return std::holds_alternative<BoundedOptions>(o.method) ? std::string() : method_text(o.method);
}

}  // namespace tind
