#pragma once
// How the library says that something did not work: a value, never an exception, never a print.
//
// Bad input, missing data, I/O, cancelled: Result. A caller's bug: assert. Exceptions of third
// parties are caught in the one .cpp that wraps that library.

#include <expected>
#include <string>
#include <utility>

namespace tind {

enum class Errc {
  invalid_argument,  // the caller asked for something that makes no sense
  bad_data,          // the input is corrupt, truncated or not what it says it is
  unsupported,       // well-formed, but not something tind reads or writes
  not_found,         // no such file, dataset or tile
  out_of_range,      // a number beyond a stated limit
  io,                // the operating system failed to read or write
  busy,              // a bounded queue is full; try again
  cancelled,         // the caller's stop_token said so
  internal,          // a bug in tind
};

/// What went wrong. `what` is one line for a person: what is wrong and what to do about it.
struct Error {
  Errc code = Errc::internal;
  std::string what;
};

template <class T>
using Result = std::expected<T, Error>;

inline std::unexpected<Error> fail(Errc code, std::string what) {
  return std::unexpected(Error{code, std::move(what)});
}

/// Adds context on the way up: "tile 9/512/211: cannot read ...".
inline std::unexpected<Error> fail(const std::string& context, const Error& cause) {
  return std::unexpected(Error{cause.code, context + ": " + cause.what});
}

}  // namespace tind
