// The process `measure`: how far is a mesh that the client sends from a dataset, or from another
// that it sends?

#include <nlohmann/json.hpp>

#include "server/api/processes/area_input.h"
#include "server/api/processes/mesh_input.h"
#include "server/api/processes/order_reading.h"
#include "terrain/base/enum_names.h"
#include "terrain/mesh/mesh_frame.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::JobOrder;

/// What two meshes that are sent have not.
constexpr const char* kOfDatasets[] = {"dataset", "layer", "bbox",  "polygon",
                                       "crs",     "datum", "frame", "units"};

/// Over the vertices of a TIN.
std::expected<JobOrder, Problems> order_of_terrain(const App& app, const Json& json) {
  OrderReading reading("measure", app, json, OrderReading::Of::mesh);
  read_mesh(reading.inputs(), reading.order, reading.problems(), "terrain");
  reading.none_of_datasets(kOfDatasets);
  reading.order.arguments.push_back("--terrain");
  reading.option("--threads", "1");
  reading.report();
  return reading.done();
}

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
  if (json.is_object() && json.contains("terrain")) return order_of_terrain(app, json);
  OrderReading reading("measure", app, json);
  // Its file comes before the DEM's.
  read_mesh(reading.inputs(), reading.order, reading.problems());
  reading.box();
  if (json.is_object() && json.contains("frame"))
    reading.option("--frame", read_word("frame", enum_names<MeshFrame>(), reading.inputs(),
                                        reading.problems(), name_of(MeshFrame::source)));
  if (json.is_object() && json.contains("units"))
    reading.option("--units", read_word("units", {"metres", "source"}, reading.inputs(),
                                        reading.problems(), "metres"));
  reading.datum();
  reading.option("--threads", "1");
  reading.report();
  return reading.done();
}

Ordered inputs_described() {
  Ordered inputs;
  describe_dem(inputs);
  inputs["dataset"]["minOccurs"] = 0;  // or terrain
  describe_mesh(inputs, 1);
  describe_mesh(inputs, 0, "terrain", "Terrain");
  inputs["terrain"]["description"] =
      "in place of a dataset: a terrain mesh (heights over a plane), over whose vertices the error "
      "is; " +
      inputs["terrain"]["description"].get<std::string>();
  inputs["frame"] =
      described("Frame", "the mesh's x and y; without it as its file says, else source",
                {{"type", "string"}, {"enum", enum_names<MeshFrame>()}});
  inputs["units"] = described(
      "Unit of z", "metres, or source (the DEM's own); without it as the file says, else metres",
      {{"type", "string"}, {"enum", {"metres", "source"}}});
  describe_area(inputs);
  inputs.erase("polygon");
  describe_datum(inputs);
  return inputs;
}

Ordered outputs_described() {
  return {{"report",
           report_output("Its error against every post or vertex, and what is wrong with it")}};
}

}  // namespace

Process measure_process() {
  return {
      "measure",
      "Measure a mesh",
      "The vertical error of a mesh, whoever made it, against every post of a DEM or every vertex "
      "of a TIN that is sent.",
      inputs_described,
      outputs_described,
      order_of_inputs};
}

}  // namespace tind::api
