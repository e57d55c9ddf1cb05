#pragma once
// A hash of numbers that somebody else chose. std::hash of a number is that number, so whoever
// writes the file can choose numbers that all fall into one bucket of a table, and reading it takes
// the square of its time.

#include <cstddef>
#include <cstdint>

namespace tind {

/// Of a key that this process drew: nobody foresees it, and it is another one in the next process.
/// So nothing that goes out may depend on the order of a table that has it.
std::uint64_t keyed_hash(std::uint64_t number);

/// For std::unordered_map.
struct KeyedHash {
  std::size_t operator()(std::uint64_t number) const { return std::size_t(keyed_hash(number)); }
};

}  // namespace tind
