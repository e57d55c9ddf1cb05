// Any bytes: no crash; what decodes is encoded again to something that says the same.

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "terrain/pyramid/residual/residual_record.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  const auto first = decode_record({data, size});
  if (!first) {
    if (first.error().what.empty()) std::abort();
    return 0;
  }
  const auto second = decode_record(encode(*first));
  if (!second || second->heights != first->heights || second->has_posts() != first->has_posts() ||
      second->posts() != first->posts())
    std::abort();
  const auto head = decode_head({data, std::min(size, kMostHeadBytes)});
  if (!head || head->posts() != first->posts() || head->has_heights == first->heights.empty())
    std::abort();
  const ResidualRecord* const only = &*first;
  const ResidualLattice lattice = lattice_of({&only, 1}, 0.25);
  for (const float r : lattice.residual)
    if (std::isnan(r)) std::abort();
  return 0;
}
