#include "server/cli/tile_options.h"

#include <CLI/CLI.hpp>
#include <charconv>

namespace tind::cli {

namespace {

/// "A-B" or "A".
bool parse_levels(const std::string& text, int& first, int& last) {
  const char* const end = text.data() + text.size();
  int low = 0, high = 0;
  auto [after, error] = std::from_chars(text.data(), end, low);
  if (error != std::errc()) return false;
  high = low;
  if (after != end) {
    if (*after != '-') return false;
    const auto second = std::from_chars(after + 1, end, high);
    if (second.ec != std::errc() || second.ptr != end) return false;
  }
  if (low < 0 || high < low || high > tiling::kMaxLevel) return false;
  first = low;
  last = high;
  return true;
}

}  // namespace

void add_levels_option(CLI::App& command, const std::string& meaning, int& first, int& last) {
  command.add_option_function<std::string>(
      "--levels",
      [&first, &last](const std::string& text) {
        if (!parse_levels(text, first, last))
          throw CLI::ValidationError(
              "--levels", "takes A-B with 0 <= A <= B <= " + std::to_string(tiling::kMaxLevel));
      },
      meaning);
}

void add_tile_options(CLI::App& command, TileSetOptions& options) {
  command
      .add_option(
          "--max-error", options.max_error_m,
          "largest vertical error at the deepest level, metres (default: 1/32 of the posts' "
          "spacing)")
      ->check(CLI::PositiveNumber);
  command
      .add_option(
          "--error-factor", options.error_factor,
          "error budget of level z is 77067.34 m / 2^z times this; 1 suits globe clients as "
          "they are")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_levels_option(
      command, "levels to make, e.g. 0-12 (default: 0 to the first at least as fine as the posts)",
      options.min_level, options.max_level);
  command
      .add_option("--side", options.side,
                  "above: no tile is below a post; below: none above one; the whole error then "
                  "lies on that side")
      ->check(CLI::IsMember({"both", "above", "below"}))
      ->capture_default_str();
  command
      .add_option("--exact-posts", options.exact_posts,
                  "errors of tiles of more posts than this are bounds by the residual index "
                  "(default: 5 million, and none of a source of up to 33 million)")
      ->check(CLI::Range(std::int64_t(1) << 16, std::int64_t(1) << 50));
  command
      .add_option("--effort", options.effort,
                  "how hard to look for fewer triangles: fast, normal, best")
      ->check(CLI::IsMember({"fast", "normal", "best"}))
      ->capture_default_str();
}

}  // namespace tind::cli
