#pragma once
// The inputs of a process as they become a subcommand's options: what orders of questions, tables
// and meshes have in common.

#include <expected>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "server/api/app.h"
#include "server/api/members.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/plain_inputs.h"
#include "server/api/processes/process.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// An order that is being read: each call takes one input and adds what it means.
class OrderReading {
 public:
  /// What the subcommand works on: a DEM of the daemon's, or terrain that the client sends.
  enum class Of { dataset, mesh };
  /// Reads dataset and layer, or mesh and mesh_format, whose file is the first argument. `json` and
  /// the app outlive it.
  OrderReading(const char* id, const App& app, const Json& json, Of = Of::dataset);
  OrderReading(const OrderReading&) = delete;
  OrderReading& operator=(const OrderReading&) = delete;

  services::JobOrder order;

  Members& inputs() { return inputs_; }
  Problems& problems() { return problems_; }
  void option(const char* flag, const std::string& text) {
    order.arguments.push_back(std::string(flag) + "=" + text);
  }
  void number(const NumberInput& n) { read_number(n, inputs_, order, problems_); }
  void place(const char* name, const char* flag) {
    option(flag, read_place(name, inputs_, problems_));
  }
  void crs();
  void datum();
  void level() { read_level(app_, dem_, inputs_, order, problems_); }
  /// bbox and polygon; a polygon becomes a file under this flag, and its rectangle, where asked
  /// for, --bounds.
  enum class Polygon { alone, with_its_box };
  void area(const char* polygon_flag, Polygon = Polygon::alone);
  /// bbox alone.
  void box();
  /// Three points [x, y, z], in the CRS of the area: after area().
  void plane();
  /// Another dataset, which the subcommand opens as it opens the first.
  void other(const char* name, const char* flag);
  /// The file that is the result, as one of these kinds.
  void file(const char* stem, std::span<const FileKind> kinds);
  void report();
  /// Of a mesh: a problem for each of these inputs that was given.
  void none_of_datasets(std::span<const char* const> names);
  /// To be called last.
  std::expected<services::JobOrder, Problems> done();

 private:
  const App& app_;
  const Of of_;
  Problems problems_;
  Members inputs_;
  DemOfJob dem_, other_;
  std::string area_crs_ = "CRS84";
};

/// How results are described.
nlohmann::ordered_json file_output(const char* title);
nlohmann::ordered_json report_output(const char* title);

}  // namespace tind::api
