#pragma once
// The inputs by which a client sends a mesh: mesh, mesh_format.

#include <nlohmann/json_fwd.hpp>

#include "server/api/members.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// As a file of the order, and the next word of its arguments.
void read_mesh(Members& inputs, services::JobOrder&, Problems&);
void describe_mesh(nlohmann::ordered_json& inputs, int least);

}  // namespace tind::api
