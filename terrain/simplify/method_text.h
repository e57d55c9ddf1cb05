#pragma once
// A method and its options as one line of text: as settings have it and records keep it.

#include <string>

#include "terrain/base/result.h"
#include "terrain/simplify/options.h"

namespace tind {

/// "edge-cost alpha=0.5 beta=2": the name, then the options that do not stand at their defaults, in
/// the order of each_option. Two methods make the same only if their texts are equal. Colours of
/// posts are no text, and left out.
std::string method_text(const MethodOptions&);

/// Back from such a line, whatever the order of its options; flags are "on" or "off". Fails
/// (invalid_argument) with what there is instead, and where a value makes no sense.
Result<MethodOptions> method_from_text(const std::string& text);

}  // namespace tind
