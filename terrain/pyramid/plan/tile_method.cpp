#include "terrain/pyramid/plan/tile_method.h"

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
                  "tiles have normals, and colours where an image is draped over them: "
                  "attribute-qem makes them with attributes auto, normal, colour or colour+normal");
  }
  return check_options(method);
}

Result<void> check_tile_method(const TileSetOptions& o) {
  if (auto ok = check_tile_method(o.method); !ok) return ok;
  const auto* const attributed = std::get_if<AttributeQemOptions>(&o.method);
  if (attributed && !o.colours && attributed->attributes != AttributeChoice::automatic &&
      may_use_colours(*attributed))
    return fail(Errc::invalid_argument,
                "attributes " + name_of(attributed->attributes) +
                    " are of an image over the tiles: say which by drape, or leave attributes out");
  return {};
}

bool keeps_colours(const TileSetOptions& o) {
  const auto* const attributed = std::get_if<AttributeQemOptions>(&o.method);
  return attributed && o.colours && may_use_colours(*attributed);
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

std::string tile_method(const TileSetOptions& o) {
  if (std::holds_alternative<BoundedOptions>(o.method)) return {};
  std::string text = method_text(o.method);
  if (keeps_colours(o)) text += " over " + o.colours->fingerprint();
  return text;
}

}  // namespace tind
