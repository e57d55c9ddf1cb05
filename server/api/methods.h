#pragma once
// The table of methods as JSON: the one text behind `tind methods --json` and GET /methods.

#include <string>

namespace tind::api {

/// A list of {name, minimises, stops, guarantees, source, take_for, voids, time_beside_qem,
/// rms_beside_qem, options}, in the order of the table.
std::string methods_json();

}  // namespace tind::api
