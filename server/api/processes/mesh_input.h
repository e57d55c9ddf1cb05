#pragma once
// The inputs by which a client sends a mesh: mesh, mesh_format; or another name and its _format.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/api/members.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// As a file of the order, and the next word of its arguments.
void read_mesh(Members& inputs, services::JobOrder&, Problems&, const std::string& input = "mesh");
void describe_mesh(nlohmann::ordered_json& inputs, int least, const std::string& input = "mesh",
                   const char* title = "Mesh");

}  // namespace tind::api
