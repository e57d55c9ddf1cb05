#include "server/cli/options/shard_number.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "terrain/pyramid/shards/shard_plan.h"

namespace tind::cli {
namespace {

using testing::ElementsAre;
using Set = std::map<std::string, std::string>;
constexpr std::size_t kShards = 8;

Result<std::vector<std::size_t>> shards(const std::string& text, const Set& set = {}) {
  return shards_to_make(text, kShards, [&](const char* name) -> std::optional<std::string> {
    const auto found = set.find(name);
    if (found == set.end()) return {};
    return found->second;
  });
}

TEST(ShardNumber, IsSaid) {
  EXPECT_THAT(*shards("0/8"), ElementsAre(0));
  EXPECT_THAT(*shards("7"), ElementsAre(7));
  EXPECT_THAT(*shards("top"), ElementsAre(ShardTiles::kTop));
  for (const char* bad : {"8/8", "8", "3/7", "-1/8", "x", "", "1/", "/8", "1/8/2", " 1", "auto"})
    EXPECT_FALSE(shards(bad)) << bad;
}

TEST(ShardNumber, IsWhatTheEngineSays) {
  EXPECT_THAT(*shards("auto", {{"SLURM_ARRAY_TASK_ID", "3"}}), ElementsAre(3));
  EXPECT_THAT(*shards("auto", {{"SLURM_ARRAY_TASK_ID", "3"},
                               {"SLURM_ARRAY_TASK_COUNT", "8"},
                               {"SLURM_ARRAY_TASK_MIN", "1"}}),
              ElementsAre(2));
  // Some again, e.g. --array=3,5.
  EXPECT_THAT(*shards("auto", {{"SLURM_ARRAY_TASK_ID", "5"},
                               {"SLURM_ARRAY_TASK_COUNT", "2"},
                               {"SLURM_ARRAY_TASK_MIN", "3"}}),
              ElementsAre(5));
  EXPECT_THAT(*shards("auto", {{"JOB_COMPLETION_INDEX", "0"}}), ElementsAre(0));
  EXPECT_THAT(*shards("auto", {{"AWS_BATCH_JOB_ARRAY_INDEX", "7"}}), ElementsAre(7));
  EXPECT_THAT(*shards("auto", {{"PARALLEL_SEQ", "1"}}), ElementsAre(0));
  EXPECT_THAT(*shards("auto", {{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "3"}}),
              ElementsAre(1, 4, 7));
  EXPECT_THAT(*shards("auto", {{"PMI_RANK", "2"}, {"PMI_SIZE", "8"}}), ElementsAre(2));
  EXPECT_THAT(*shards("auto", {{"PMI_RANK", "2"},
                               {"PMI_SIZE", "8"},
                               {"OMPI_COMM_WORLD_RANK", "2"},
                               {"OMPI_COMM_WORLD_SIZE", "8"}}),
              ElementsAre(2));
  // A task of an array that was begun by a launcher of ranks.
  EXPECT_THAT(*shards("auto", {{"SLURM_ARRAY_TASK_ID", "3"}, {"PMI_RANK", "0"}, {"PMI_SIZE", "1"}}),
              ElementsAre(3));
  // More ranks than shards: some have nothing to do.
  EXPECT_THAT(*shards("auto", {{"PMI_RANK", "1"}, {"PMI_SIZE", "9"}}), ElementsAre(1));
  EXPECT_THAT(*shards("auto", {{"PMI_RANK", "8"}, {"PMI_SIZE", "9"}}), ElementsAre());
}

TEST(ShardNumber, IsRefusedWhereItCannotBe) {
  const Set bad[] = {{{"SLURM_ARRAY_TASK_ID", "8"}},
                     {{"SLURM_ARRAY_TASK_ID", "1"}, {"SLURM_ARRAY_TASK_COUNT", "9"}},
                     {{"SLURM_ARRAY_TASK_ID", "one"}},
                     {{"PARALLEL_SEQ", "0"}},
                     {{"PARALLEL_SEQ", "9"}},
                     {{"JOB_COMPLETION_INDEX", "-1"}},
                     {{"OMPI_COMM_WORLD_RANK", "1"}},
                     {{"PMI_RANK", "1"}, {"PMI_SIZE", "0"}},
                     {{"PMI_RANK", "9"}, {"PMI_SIZE", "9"}},
                     {{"PARALLEL_SEQ", "2"}, {"JOB_COMPLETION_INDEX", "2"}}};
  for (const Set& set : bad) {
    const auto found = shards("auto", set);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, Errc::invalid_argument);
  }
}

}  // namespace
}  // namespace tind::cli
