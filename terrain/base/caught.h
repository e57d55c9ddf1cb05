#pragma once
// Exceptions that nobody foresaw, as errors: where they end a piece of work, and not the program;
// and which errors may be gone when one tries again.

#include <exception>
#include <new>
#include <string>

#include "terrain/base/result.h"

namespace tind {

inline constexpr const char* kNoMemory = "there is not enough memory just now";

/// busy where memory has run out, which may be there again; else internal.
inline Error caught(const std::exception& thrown) {
  if (dynamic_cast<const std::bad_alloc*>(&thrown))
    return {Errc::busy, std::string(kNoMemory) + ": try again"};
  return {Errc::internal, thrown.what()};
}

/// The system or the other side failed just now, which says nothing of what was asked for.
inline bool may_pass(const Error& error) {
  return error.code == Errc::io || error.code == Errc::busy;
}

}  // namespace tind
