#pragma once
// What a daemon wants of its process and of the system: signals, memory, descriptors, a limit of
// time at the end.

#include <chrono>
#include <cstddef>

namespace tind::cli {

/// What would end a daemon by default although nobody wants it to end: a reader of its output that
/// has gone, and signals that it has no use for. SIGHUP has its handler once the server listens;
/// before that it is remembered.
void ignore_signals();
/// Was there a SIGHUP since ignore_signals(), before the server had a handler of its own?
bool has_hung_up();

bool has_terminal();

/// The process ends with this code even if a worker never looks at its stop token; where the system
/// has no thread for that, once all have looked.
void end_within(std::chrono::milliseconds time, int code);

/// What libraries would take by themselves: an arena per thread keeps what was freed, so that with
/// many threads a daemon seems to leak. GDAL's block cache stands before one of our own. Before
/// there are other threads.
void bound_memory();

/// As many descriptors as the system lets us have; the rest is what connections may use: at most
/// `wanted`.
std::size_t connections_within_limits(std::size_t wanted);

}  // namespace tind::cli
