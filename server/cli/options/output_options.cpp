#include "server/cli/options/output_options.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/cli/program/exit.h"

namespace tind::cli {

void add_mesh_output(Command app, MeshOutput& output) {
  app.add_option("-o,--output", output.path,
                 "the mesh: " + writable_extensions() + "; 'tind formats' says what each can carry")
      .required();
  std::vector<std::string> names;
  for (const MeshFormat& f : mesh_formats())
    if (f.encode) names.push_back(f.name);
  app.add_option("--format", output.format, "of the mesh, where the extension does not say it")
      .one_of(names);
}

Result<const MeshFormat*> format_of(const MeshOutput& output) {
  return format_to_write(output.path, output.format);
}

int put_mesh(const MeshOutput& output, const MeshFormat& format, const proto::Mesh& mesh) {
  const auto ok = write_mesh(output.path, format, mesh);
  if (!ok) return complain(ok.error());
  if (format.one_unit && mesh.place.geographic && !mesh.place.local)
    warn(
        fmt::format("{}: x and y are degrees, which readers of {} take for the unit of z: "
                    "--frame metric of simplify and refine makes them metres, gdalwarp the DEM's",
                    output.path, format.title));
  else if (format.one_unit && !mesh.place.local && !mesh.place.geographic &&
           std::abs(mesh.place.unit_m - mesh.place.z_unit_m) > 1e-6 * mesh.place.unit_m)
    warn(fmt::format(
        "{}: x and y are in units of {:.10g} m and z in units of {:.10g} m, which readers "
        "of {} take for the same: --frame metric of simplify and refine makes all metres",
        output.path, mesh.place.unit_m, mesh.place.z_unit_m, format.title));
  return kOk;
}

Tin as_in_file(const MeshFormat& format, proto::Mesh mesh) {
  if (format.as_in_file) mesh = format.as_in_file(std::move(mesh));
  return from_file_mesh(std::move(mesh));
}

void add_file_origin(nlohmann::ordered_json& report, const MeshFormat& format,
                     const proto::Mesh& mesh) {
  if (const auto origin = file_origin(format, mesh)) report["file_origin"] = *origin;
}

std::string file_origin_line(const nlohmann::ordered_json& report) {
  if (!report.contains("file_origin")) return {};
  const auto [x, y, z] = report["file_origin"].get<std::array<double, 3>>();
  return fmt::format("origin: the file counts from {} {} {}, as its header says\n", x, y, z);
}

nlohmann::ordered_json place_json(const proto::MeshPlace& place) {
  nlohmann::ordered_json j = {{"crs", place.crs_name}};
  j["epsg"] = place.epsg > 0 ? nlohmann::ordered_json(place.epsg) : nullptr;
  j["crs_wkt"] = place.crs_wkt;
  j["vertical_datum"] = place.vertical_datum;
  if (!place.local) return j;
  j["origin"] = place.origin;
  j["metres_to_crs"] = place.to_crs;
  return j;
}

bool is_known(const proto::MeshPlace& place) { return !proto::place_lines(place).empty(); }

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
