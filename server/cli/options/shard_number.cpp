#include "server/cli/options/shard_number.h"

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "terrain/pyramid/shards/shard_plan.h"

namespace tind::cli {

namespace {

using Numbers = std::vector<std::size_t>;

std::optional<std::uint64_t> whole(std::string_view text) {
  std::uint64_t n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return n;
}

std::unexpected<Error> wrong(const std::string& what) {
  return fail(Errc::invalid_argument, "--shard: " + what);
}

/// What a kind of engine says.
struct Kind {
  const char *number, *count, *first;  // names of variables; null: it has none
  std::uint64_t begins;                // where it has none
  bool ranks;                          // every rank makes more than one, where they are fewer
};
constexpr Kind kKinds[] = {
    {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN", 0, false},
    {"JOB_COMPLETION_INDEX", nullptr, nullptr, 0, false},
    {"AWS_BATCH_JOB_ARRAY_INDEX", nullptr, nullptr, 0, false},
    {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", nullptr, 0, true},
    {"PMI_RANK", "PMI_SIZE", nullptr, 0, true},
    {"PARALLEL_SEQ", nullptr, nullptr, 1, false}};

Result<std::uint64_t> value_of(const char* name, const Variables& variables) {
  const auto text = variables(name);
  const auto n = text ? whole(*text) : std::nullopt;
  if (!n)
    return wrong(std::string(name) + " is " + (text ? "'" + *text + "', no number" : "not set"));
  return *n;
}

Result<Numbers> numbers_of(const Kind& kind, std::size_t shards, const Variables& variables) {
  const auto number = value_of(kind.number, variables);
  if (!number) return std::unexpected(number.error());
  std::uint64_t first = kind.begins, count = shards;
  if (kind.count && (kind.ranks || variables(kind.count))) {
    const auto said = value_of(kind.count, variables);
    if (!said) return std::unexpected(said.error());
    count = *said;
  }
  if (kind.first && count == shards && variables(kind.first)) {
    const auto said = value_of(kind.first, variables);
    if (!said) return std::unexpected(said.error());
    first = *said;
  }
  if (kind.ranks && *number < count && *number >= shards) return Numbers{};  // none is left for it
  if (count == 0 || (count > shards && !kind.ranks))
    return wrong(std::string(kind.count) + " is " + std::to_string(count) + ", and the plan has " +
                 std::to_string(shards) + " shards");
  if (*number < first || *number - first >= shards)
    return wrong(std::string(kind.number) + " is " + std::to_string(*number) +
                 ", and the plan has " + std::to_string(shards) + " shards");
  Numbers mine{std::size_t(*number - first)};
  if (kind.ranks)
    while (mine.back() + count < shards) mine.push_back(mine.back() + std::size_t(count));
  return mine;
}

Result<Numbers> from_engine(std::size_t shards, const Variables& variables) {
  std::optional<Numbers> found;
  std::string by;
  for (const Kind& kind : kKinds) {
    if (!variables(kind.number)) continue;
    // One rank alone, as a launcher leaves it in each task of an array, says nothing.
    if (found && kind.ranks && variables(kind.count) == "1") continue;
    const auto mine = numbers_of(kind, shards, variables);
    if (!mine) return mine;
    if (found && *found != *mine)
      return wrong(by + " and " + kind.number +
                   " are both set and say different shards: say --shard i/N");
    found = *mine, by = kind.number;
  }
  if (found) return *found;
  std::string names;
  for (const Kind& kind : kKinds) names += (names.empty() ? "" : ", ") + std::string(kind.number);
  return wrong("auto takes it from one of " + names + ", and none is set");
}

}  // namespace

Result<Numbers> shards_to_make(const std::string& text, std::size_t count,
                               const Variables& variables) {
  if (text == "auto") return from_engine(count, variables);
  if (text == "top") return Numbers{ShardTiles::kTop};
  const auto slash = text.find('/');
  const auto number = whole(std::string_view(text).substr(0, slash));
  const auto of = slash == text.npos ? std::optional<std::uint64_t>(count)
                                     : whole(std::string_view(text).substr(slash + 1));
  if (!number || !of) return wrong("'" + text + "': takes i/N (i from 0), i, top, or auto");
  if (*of != count) return wrong(text + ": the plan has " + std::to_string(count) + " shards");
  if (*number >= count)
    return wrong(text + ": the plan has shards 0 to " + std::to_string(count - 1));
  return Numbers{std::size_t(*number)};
}

Variables environment_variables() {
  return [](const char* name) -> std::optional<std::string> {
    const char* const value = std::getenv(name);
    return value ? std::optional<std::string>(value) : std::nullopt;
  };
}

}  // namespace tind::cli
