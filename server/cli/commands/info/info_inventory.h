#pragma once
// The part of `tind info` that is about many inputs: a line each.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::cli {

/// What one input is, as --json has it; prints nothing.
using DescribeInput = std::function<Result<nlohmann::ordered_json>(const std::string& path)>;

/// What the inputs that are DEMs make together, {"kind": "layers", ...}; null where that is
/// nothing.
using DescribeTogether =
    std::function<nlohmann::ordered_json(const std::vector<std::string>& dems)>;

/// Prints a line for each input as soon as it is known, what it is or why it cannot be read, then
/// the layers that the DEMs make; or, for `json`, a list of all. Returns kOk, or the exit code of
/// the first that cannot be read.
int print_inventory(const std::vector<std::string>& inputs, const DescribeInput&,
                    const DescribeTogether&, bool json);

}  // namespace tind::cli
