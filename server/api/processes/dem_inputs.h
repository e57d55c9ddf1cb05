#pragma once
// The inputs by which a client says which DEM, and what its heights are to be above.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "server/api/app.h"
#include "server/api/members.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// All inputs that are a dataset's name: a key may not be for it.
inline constexpr const char* kDatasetInputs[] = {"dataset", "against", "less"};

/// A DEM that a job can open.
struct DemOfJob {
  std::shared_ptr<const services::ServedDataset> dataset;
  const DemRecipe* recipe = nullptr;  // of the dataset; null: there is none (and a problem)
  const DemInfo* info = nullptr;      // where there is a recipe
};

/// dataset; layer, where the dataset has several.
DemOfJob read_dem(const App&, Members& inputs, Problems&);
/// datum, as --to-datum takes it; empty: as the source has it. No file. A problem where the DEM's
/// heights cannot be above it: before a job finds that. Reads the grids that it takes, as far as
/// the daemon has not: on a worker.
std::string read_datum(const App&, const DemOfJob&, Members& inputs, Problems&);
/// level, in place of the DEM: what a client sees that draws this level of the dataset's tiles. A
/// problem where these are not of that DEM alone, and with a datum: heights are then the tiles'.
void read_level(const App&, const DemOfJob&, Members& inputs, services::JobOrder&, Problems&);
/// A word from a list; `initial` without one.
std::string read_word(const char* name, const std::vector<std::string>& words, Members& inputs,
                      Problems&, const std::string& initial);

/// The DEM as words of the order, as the operator said how it is to be opened; its paths are not
/// for clients. REQUIRES: a recipe.
void add_dem(const DemOfJob&, services::JobOrder&);

/// How inputs are described: {title, description, minOccurs, schema}.
nlohmann::ordered_json described(const char* title, const std::string& description,
                                 nlohmann::ordered_json schema, int least = 0);
/// Those of read_dem(), datum, and level.
void describe_dem(nlohmann::ordered_json& inputs);
void describe_level(nlohmann::ordered_json& inputs);
void describe_datum(nlohmann::ordered_json& inputs);

}  // namespace tind::api
