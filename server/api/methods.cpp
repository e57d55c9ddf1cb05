// /methods: what each way of simplifying minimises, where it can stop, what it guarantees.

#include "server/api/methods.h"

#include <nlohmann/json.hpp>

#include "server/api/app.h"
#include "server/api/responses.h"
#include "terrain/simplify/constraints/voids.h"
#include "terrain/simplify/methods.h"

namespace tind::api {

std::string methods_json() {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const MethodInfo& m : methods()) {
    all.push_back({{"name", m.name},
                   {"minimises", m.minimises},
                   {"stops", m.stops},
                   {"guarantees", m.guarantees},
                   {"source", m.source},
                   {"take_for", m.take_for},
                   {"voids", name_of(Voids::cover)},
                   {"time_beside_qem", m.time},
                   {"rms_beside_qem", m.rms},
                   {"tiles", m.tiles},
                   {"options", m.options}});
  }
  return all.dump(2) + "\n";
}

namespace {

const http::Operation kMethods = {
    .id = "getMethods",
    .tag = "About",
    .summary = "The methods of simplification: what each minimises and guarantees",
    .scope = http::Scope::read,
    .heeds_access = true,
    .ignores_others = true,
    .responses = resource("All methods.", "application/json",
                          R"({"type": "array", "items": {"type": "object"}})")};

}  // namespace

void add_method_routes(http::Router& router) {
  const auto all = http::Representation::make(methods_json(), {.content_type = "application/json"});
  router.get("/methods", kMethods, [all](const http::Request& request, http::DeferredReply&) {
    return all->reply(request.head.fields);
  });
}

}  // namespace tind::api
