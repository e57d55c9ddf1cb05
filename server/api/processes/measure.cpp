// The process `measure`: how far is a mesh that the client sends from a dataset?

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

std::expected<JobOrder, Problems> order_of_inputs(const App& app, const Json& json) {
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
  describe_mesh(inputs, 1);
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
  return {{"report", report_output("Its error against every post, and what is wrong with it")}};
}

}  // namespace

Process measure_process() {
  return {"measure",
          "Measure a mesh",
          "The vertical error of a mesh, whoever made it, against every post of a DEM.",
          inputs_described,
          outputs_described,
          order_of_inputs};
}

}  // namespace tind::api
