#pragma once
// The table of methods as JSON: the one text behind `tind methods --json` and GET /methods.

#include <string>

namespace tind::api {

/// A list of {name, minimises, stops, guarantees, source}, in the order of the table.
std::string methods_json();

}  // namespace tind::api
