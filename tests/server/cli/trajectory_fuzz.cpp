// Any bytes as a trajectory: refused with a reason, or fixes on earth, in a finite time.

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "server/cli/options/trajectory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const std::optional<double> speed : {std::optional<double>(), std::optional<double>(100)}) {
    const auto flight = cli::parse_trajectory(text, speed);
    if (!flight && flight.error().what.empty()) std::abort();
    if (!flight) continue;
    if (flight->empty()) std::abort();
    for (const FlightFix& f : *flight)
      if (!std::isfinite(f.time_s) || !(std::abs(f.where.lat) <= 90)) std::abort();
  }
  return 0;
}
