#pragma once
// What the program prints as JSON, for tests (needs googletest, which fuzz targets do without).

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.h"

namespace tind::test {

/// Runs `tind` as run_tind does; fails the test when it does not end well.
inline nlohmann::json tind_json(const std::string& arguments) {
  const Ran ran = run_tind(arguments);
  EXPECT_EQ(ran.code, 0) << arguments << "\n" << ran.out;
  return nlohmann::json::parse(ran.answer, nullptr, false);
}

}  // namespace tind::test
