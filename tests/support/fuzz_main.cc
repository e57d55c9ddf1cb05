// Runs a fuzz target without libFuzzer: every seed file, then seeded mutations of each.
//   fuzz_replay TARGET FOLDER...

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string_view>
#include <vector>

// Here each target's entry has the name of its file.
#define TARGET(name) extern "C" int name(const std::uint8_t* data, std::size_t size);
#include "fuzz_targets.inc"
#undef TARGET

namespace {

using Target = int (*)(const std::uint8_t*, std::size_t);

Target target_named(const std::string_view asked) {
#define TARGET(name) \
  if (asked == #name) return name;
#include "fuzz_targets.inc"
#undef TARGET
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  const Target target = argc > 1 ? target_named(argv[1]) : nullptr;
  if (!target) {
    std::fprintf(stderr, "fuzz_replay: no target '%s'\n", argc > 1 ? argv[1] : "");
    return 2;
  }
  std::vector<std::vector<std::uint8_t>> seeds = {{}};
  for (int i = 2; i < argc; ++i) {
    if (!std::filesystem::is_directory(argv[i])) continue;
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      std::ifstream in(entry.path(), std::ios::binary);
      seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
  }
  std::mt19937_64 random(1);
  std::size_t runs = 0;
  for (const auto& seed : seeds) {
    target(seed.data(), seed.size());
    ++runs;
    for (int round = 0; round < 300; ++round) {
      std::vector<std::uint8_t> bytes = seed;
      if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 64));
      for (int edits = 1 + int(random() % 8); edits > 0 && !bytes.empty(); --edits)
        bytes[random() % bytes.size()] = std::uint8_t(random() % 3 ? random() : random() % 2 * 255);
      target(bytes.data(), bytes.size());
      ++runs;
    }
  }
  std::printf("%zu inputs, no crash\n", runs);
  return 0;
}
