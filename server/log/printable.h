#pragma once
// Text from outside, made harmless for terminals and logs.

#include <string>
#include <string_view>

namespace tind::logging {

/// One line: control bytes (those of C1 in UTF-8, too) as \xNN.
std::string printable(std::string_view);

}  // namespace tind::logging
