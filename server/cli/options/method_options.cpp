#include "server/cli/options/method_options.h"

#include <algorithm>

#include "terrain/base/result.h"
#include "terrain/simplify/methods.h"

namespace tind::cli {

Result<void> check_method_options(Command app, const std::string& method) {
  const auto all = methods();
  const auto chosen = std::ranges::find(all, method, &MethodInfo::name);
  if (chosen == all.end()) return no_such_method(method);
  for (const MethodInfo& other : all) {
    for (const std::string& name : other.options) {
      if (!app.given("--" + name) || std::ranges::count(chosen->options, name)) continue;
      return fail(Errc::invalid_argument, "--" + name + " is for " + other.name + ", not for " +
                                              method + ": leave it out, or choose --method " +
                                              other.name);
    }
  }
  return {};
}

void add_method_options(Command app, SimplifyOptions& o) {
  app.add_option("--method", o.method, "how; 'tind methods' says which to take for what").shown();
  app.add_option("--alpha", o.alpha, "edge-cost: weight of the height difference").shown();
  app.add_option("--beta", o.beta, "edge-cost: weight of the degree").shown();
  app.add_option("--term", o.term, "edge-cost: all terms, or one alone")
      .one_of({"all", "length", "height", "degree"})
      .shown();
  app.add_flag("--subset-placement", o.subset_placement,
               "qem: keep a subset of the posts as vertices");
  app.add_flag("--border-constraints", o.border_constraints, "qem: hold the border's profile");
  app.add_choice("--effort", o.effort, "bounded: how hard to search").shown();
  app.add_choice("--side", o.side, "bounded: the mesh on both sides of the terrain, above, below")
      .shown();
  app.add_option("--criterion", o.criterion, "vertex-removal: which vertices go first")
      .one_of({"plane", "degree", "k-degree"})
      .shown();
  app.add_option("--k", o.k, "vertex-removal by k-degree: neighbours that break a tie").shown();
  app.add_option("--placement", o.placement, "triangle-collapse: where the merged vertex goes")
      .one_of({"quadric", "centroid"})
      .shown();
  app.add_option("--attributes", o.attributes, "attribute-qem: which attributes take part")
      .one_of({"auto", "texture", "colour", "normal", "colour+normal"})
      .shown();
  app.add_option("--attribute-metric", o.attribute_metric,
                 "attribute-qem: joint with the shape, separate as in progressive meshes, ignored")
      .one_of({"joint", "separate", "ignored"})
      .shown();
  app.add_option("--attribute-weight", o.attribute_weight,
                 "attribute-qem: attributes against position; 1 is the measured default")
      .shown();
  app.add_option("--threads", o.threads, "threads to use, 0: one per core").not_negative().shown();
}

}  // namespace tind::cli
