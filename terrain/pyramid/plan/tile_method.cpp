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
    const AttributeChoice by = attributed->attributes;
    if (attributed->drape || (by != AttributeChoice::automatic && by != AttributeChoice::normal))
      return fail(Errc::invalid_argument,
                  "tiles have no attributes but normals: attribute-qem makes them with attributes "
                  "auto or normal");
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

std::string tile_method(const TileSetOptions& o) {
  return std::holds_alternative<BoundedOptions>(o.method) ? std::string() : method_text(o.method);
}

}  // namespace tind
