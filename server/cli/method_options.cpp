#include "server/cli/method_options.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace tind::cli {

void add_method_options(CLI::App& app, SimplifyOptions& o) {
  app.add_option("--method", o.method, "how; 'tind methods' describes them")->capture_default_str();
  app.add_option("--alpha", o.alpha, "edge-cost: weight of the height difference")
      ->capture_default_str();
  app.add_option("--beta", o.beta, "edge-cost: weight of the degree")->capture_default_str();
  app.add_option("--term", o.term, "edge-cost: all terms, or one alone")
      ->check(CLI::IsMember({"all", "length", "height", "degree"}))
      ->capture_default_str();
  app.add_flag("--subset-placement", o.subset_placement,
               "qem: keep a subset of the posts as vertices");
  app.add_flag("--border-constraints", o.border_constraints, "qem: hold the border's profile");
  app.add_option("--effort", o.effort, "bounded: how hard to search")
      ->check(CLI::IsMember({"fast", "normal", "best"}))
      ->capture_default_str();
  app.add_option("--side", o.side, "bounded: the mesh on both sides of the terrain, above, below")
      ->check(CLI::IsMember({"both", "above", "below"}))
      ->capture_default_str();
  app.add_option("--criterion", o.criterion, "vertex-removal: which vertices go first")
      ->check(CLI::IsMember({"plane", "degree", "k-degree"}))
      ->capture_default_str();
  app.add_option("--k", o.k, "vertex-removal by k-degree: neighbours that break a tie")
      ->capture_default_str();
  app.add_option("--placement", o.placement, "triangle-collapse: where the merged vertex goes")
      ->check(CLI::IsMember({"quadric", "centroid"}))
      ->capture_default_str();
  app.add_option("--attributes", o.attributes, "attribute-qem: which attributes take part")
      ->check(CLI::IsMember({"auto", "texture", "colour", "normal", "colour+normal"}))
      ->capture_default_str();
  app.add_option("--attribute-metric", o.attribute_metric,
                 "attribute-qem: joint with the shape, separate as in progressive meshes, ignored")
      ->check(CLI::IsMember({"joint", "separate", "ignored"}))
      ->capture_default_str();
  app.add_option("--attribute-weight", o.attribute_weight,
                 "attribute-qem: attributes against position; 1 is the measured default")
      ->capture_default_str();
  app.add_option("--threads", o.threads, "threads to use, 0: one per core")->capture_default_str();
}

}  // namespace tind::cli
