#include "server/cli/output_options.h"

namespace tind::cli {

void add_frame_option(CLI::App& app, std::string& frame) {
  app.add_option("--frame", frame, "x and y in the DEM's own CRS, or metres from its first post")
      ->check(CLI::IsMember({"source", "metric"}))
      ->capture_default_str();
}

void add_progress_option(CLI::App& app, std::string& progress) {
  app.add_option("--progress", progress, "auto, bar, lines or none")
      ->check(CLI::IsMember({"auto", "bar", "lines", "none"}))
      ->capture_default_str();
}

void add_json_flag(CLI::App& app, bool& json) {
  app.add_flag("--json", json, "print the figures as JSON");
}

}  // namespace tind::cli
