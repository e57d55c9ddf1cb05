#pragma once
// Queries that are numbers by name.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/problem.h"

namespace tind::http {

struct QueryNumber {
  std::string_view name;
  double least, most;
  std::string_view unit;        // as in "must be metres from 0 to 9": words for a person
  bool whole = false;           // no fractions
  std::string_view about = {};  // what it means, where the name does not say
  std::string_view example = {};
};

/// A parameter that is one of some words, or of a form.
struct QueryWord {
  std::string_view name;
  std::vector<std::string_view> words;
  bool (*fits)(std::string_view) = nullptr;  // further words
  std::string_view form = {};                // what these look like, for a person
  std::string_view about = {};               // what it means
  std::string_view pattern = {};             // of what fits: a regular expression of ECMA-262
  std::string_view example = {};
};

struct QueryNumbers {
  std::vector<std::optional<double>> values;  // as the numbers that may be there; none: not given
  std::vector<std::string> words;             // as the words; empty: not given
  std::vector<ParameterProblem> problems;
};

/// Every parameter must be one of `known`, once, and within its limits; what is not is a problem.
QueryNumbers read_numbers(std::string_view query, std::span<const QueryNumber> known,
                          std::span<const QueryWord> words = {});

}  // namespace tind::http
