#pragma once
// Bytes that nobody guesses: of secrets, and of names that stand for rights.

#include <cstdint>
#include <span>

#include "terrain/base/result.h"

namespace tind {

/// At most 256, from the system's generator. io where it gives none, as behind a filter of system
/// calls that does not know getrandom(2).
Result<void> random_bytes(std::span<std::uint8_t> bytes);

}  // namespace tind
