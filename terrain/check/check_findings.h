#pragma once
// What a check found, counted by rule, with a few examples each.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "terrain/check/check_rules.h"

namespace tind {

class Findings {
 public:
  static constexpr std::size_t kExamples = 5;

  struct Count {
    std::uint64_t count = 0;
    std::vector<std::string> examples;
  };

  /// One more breach of a rule; `where` is a tile ("12/3/4") or a file.
  void add(std::size_t rule, const std::string& where, const std::string& detail) {
    Count& c = counts_[rule];
    ++c.count;
    if (c.examples.size() < kExamples)
      c.examples.push_back(detail.empty() ? where : where + ": " + detail);
  }

  /// So many more, without saying where.
  void count(std::size_t rule, std::uint64_t more) { counts_[rule].count += more; }

  /// Appends another's findings; merged in a fixed order, the result does not depend on threads.
  void merge(const Findings& other) {
    for (std::size_t r = 0; r < kCheckRuleCount; ++r) {
      counts_[r].count += other.counts_[r].count;
      for (const std::string& example : other.counts_[r].examples)
        if (counts_[r].examples.size() < kExamples) counts_[r].examples.push_back(example);
    }
  }

  const Count& operator[](std::size_t rule) const { return counts_[rule]; }
  std::uint64_t total(Severity severity) const {
    std::uint64_t sum = 0;
    for (std::size_t r = 0; r < kCheckRuleCount; ++r)
      if (kCheckRules[r].severity == severity) sum += counts_[r].count;
    return sum;
  }

 private:
  std::array<Count, kCheckRuleCount> counts_;
};

}  // namespace tind
