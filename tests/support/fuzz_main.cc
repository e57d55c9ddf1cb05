// Runs a fuzz target without libFuzzer: every seed file, then seeded mutations of each. None may
// take more memory at a time than its bytes explain.
//   fuzz_replay TARGET FOLDER...

#include <malloc.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <random>
#include <string_view>
#include <vector>

// Sanitizers have operators of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
namespace {
std::atomic<std::size_t> live = 0, peak = 0;
}
#else
namespace {

std::atomic<std::size_t> live = 0, peak = 0;  // of operator new, in all threads

void* taken(void* p) {
  if (!p) throw std::bad_alloc();
  const std::size_t now = live += ::malloc_usable_size(p);
  for (std::size_t most = peak; most < now && !peak.compare_exchange_weak(most, now);) {
  }
  return p;
}
void give_back(void* p) {
  live -= ::malloc_usable_size(p);
  std::free(p);
}

}  // namespace
void* operator new(std::size_t n) { return taken(std::malloc(n)); }
void* operator new(std::size_t n, std::align_val_t a) {
  return taken(std::aligned_alloc(std::size_t(a),
                                  (n + std::size_t(a) - 1) / std::size_t(a) * std::size_t(a)));
}
void operator delete(void* p) noexcept { give_back(p); }
void operator delete(void* p, std::size_t) noexcept { give_back(p); }
void operator delete(void* p, std::align_val_t) noexcept { give_back(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { give_back(p); }
#endif

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

// What is read, its tables and what is written of it again. A raster may say of a few bytes that
// they are a block of 64 MiB.
constexpr std::size_t kPerByte = 256, kAlways = 1 << 20, kOfARaster = 96 << 20;

/// False where it took more.
bool try_it(Target target, const std::vector<std::uint8_t>& bytes) {
  const std::size_t before = live;
  peak = before;
  target(bytes.data(), bytes.size());
  const std::size_t took = peak - before;
  const std::size_t always = target == target_named("dem_fuzz") ? kOfARaster : kAlways;
  if (took <= always + kPerByte * bytes.size()) return true;
  std::fprintf(stderr, "fuzz_replay: %zu bytes took %zu of memory\n", bytes.size(), took);
  return false;
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
  bool good = true;
  for (const auto& seed : seeds) {
    good = try_it(target, seed) && good;
    ++runs;
    for (int round = 0; round < 300; ++round) {
      std::vector<std::uint8_t> bytes = seed;
      if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 64));
      for (int edits = 1 + int(random() % 8); edits > 0 && !bytes.empty(); --edits)
        bytes[random() % bytes.size()] = std::uint8_t(random() % 3 ? random() : random() % 2 * 255);
      good = try_it(target, bytes) && good;
      ++runs;
    }
  }
  std::printf("%zu inputs, no crash\n", runs);
  return good ? 0 : 1;
}
