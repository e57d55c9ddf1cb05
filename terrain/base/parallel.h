#pragma once
// The one way the library uses several cores.

#include <cstddef>
#include <functional>

namespace tind {

/// Calls `body(i)` once for every i in [0, count), on up to `threads` threads (0: one per core).
/// Which thread runs which i is not specified: results must be stored by i, so that they do not
/// depend on the number of threads. Where the system has no more threads, fewer do it. An exception
/// of a body is rethrown here after all have stopped.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body);

/// The number of threads that `threads == 0` stands for.
int hardware_threads();

}  // namespace tind
