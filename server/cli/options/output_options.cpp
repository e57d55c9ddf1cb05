#include "server/cli/options/output_options.h"

namespace tind::cli {

void add_frame_option(Command app, MeshFrame& frame) {
  app.add_choice("--frame", frame, "x and y in the DEM's own CRS, or metres from its first post")
      .shown();
}

void add_progress_option(Command app, std::string& progress) {
  app.add_option("--progress", progress, "auto, bar, lines or none")
      .one_of({"auto", "bar", "lines", "none"})
      .shown();
}

void add_json_flag(Command app, bool& json) {
  app.add_flag("--json", json, "print the figures as JSON");
}

}  // namespace tind::cli
