#include "server/cli/options/tile_options.h"

#include <fmt/format.h>

#include <charconv>

#include "server/cli/program/exit.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/tile_method.h"

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

void add_levels_option(Command command, const std::string& meaning, int& first, int& last) {
  command.add_function(
      "--levels",
      [&first, &last](const std::string& text) {
        if (!parse_levels(text, first, last))
          refuse_value("--levels",
                       "takes A-B with 0 <= A <= B <= " + std::to_string(tiling::kMaxLevel));
      },
      meaning);
}

void add_tile_options(Command command, TileSetOptions& options) {
  command
      .add_option(
          "--max-error", options.max_error_m,
          "largest vertical error at the deepest level, metres (default: 1/32 of the posts' "
          "spacing)")
      .positive();
  command
      .add_option(
          "--error-factor", options.error_factor,
          "error budget of level z is 77067.34 m / 2^z times this; 1 suits globe clients as "
          "they are")
      .positive()
      .shown();
  command
      .add_option("--deepest", options.max_level,
                  "the pyramid ends at this level, which then has the largest error of --max-error "
                  "(default: the first level at least as fine as the posts)")
      .range(0, tiling::kMaxLevel);
  add_levels_option(command,
                    "only these levels of the pyramid, e.g. 0-8: the same tiles, byte for byte, as "
                    "of all of them (default: all)",
                    options.first_level, options.last_level);
  command
      .add_choice("--side", options.side,
                  "above: no tile is below a post; below: none above one; the whole error then "
                  "lies on that side")
      .shown();
  command
      .add_option("--exact-posts", options.exact_posts,
                  "errors of tiles of more posts than this are bounds by the residual index "
                  "(default: 2.5 million, and none of a source of up to 33 million)")
      .range(std::int64_t(1) << 16, std::int64_t(1) << 50);
  command
      .add_choice(
          "--effort", options.effort,
          "bounded: how hard to look for fewer triangles: fast, normal, best; also for tiles "
          "that it makes because another method cannot keep their budget")
      .shown();
}

void add_tile_method(Command command, MethodLine& line) {
  add_method_choice(command, line, {"side", "effort"});
}

Result<void> set_tile_method(Command command, const MethodLine& line, TileSetOptions& options) {
  const auto method = method_of(command, line, {"side", "effort", "drape"});
  if (!method) return std::unexpected(method.error());
  options.method = *method;
  return check_tile_method(options.method);
}

void warn_of_plan(const Surface& surface, const TileSetOptions& options) {
  const auto plan = TilePlan::make(surface, HeightRange{}, options);
  const std::string warning = plan ? plan->warning(surface) : std::string();
  if (!warning.empty()) warn(warning);
}

}  // namespace tind::cli
