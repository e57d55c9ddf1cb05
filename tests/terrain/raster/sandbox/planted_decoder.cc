// A decoder that a raster has taken over, as sandbox_test.cpp asks for it: it opens files as it
// should, and does what its first argument says when heights are asked for (or before).

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "terrain/raster/gdal/heights/file_wire.h"
#include "terrain/raster/gdal/heights/gdal_file.h"
#include "terrain/raster/sandbox/lockdown.h"
#include "terrain/raster/sandbox/wire.h"

namespace {

using namespace tind;
using sandbox::Ask;
using sandbox::Reply;
using sandbox::Request;

std::byte* memory = nullptr;

void say(const Reply& reply, std::size_t bytes = sizeof(Reply)) {
  std::array<char, 2 * sizeof(Reply)> packet{};
  std::memcpy(packet.data(), &reply, sizeof reply);
  if (::write(sandbox::kSocket, packet.data(), bytes) < 0) ::_exit(9);
}

std::string brief() {
  std::string bytes;
  char some[4096];
  for (ssize_t n; (n = ::read(sandbox::kBrief, some, sizeof some)) > 0;) bytes.append(some, n);
  return bytes;
}

/// What it says of a file, changed as the argument wants it.
std::string told(const std::string& how, const gdal::HeightFile& file) {
  std::string text = gdal::opened_text(file);
  const auto swap = [&](const std::string& from, const std::string& to) {
    if (const auto at = text.find(from); at != text.npos) text.replace(at, to.size(), to);
  };
  if (how == "says too little") text.resize(text.size() / 2);
  if (how == "says too much") text += "more";
  if (how == "names another driver") swap("GTiff", "MRF  ");
  if (how == "names another file") swap("/crater.tif", "/passwd.tif");
  if (how == "names a pipeline") swap("PROJCRS[", "+proj=pi");
  if (how == "has no columns") std::fill_n(text.begin() + 4 + 5, 8, '\0');
  return text;
}

[[noreturn]] void spin() {
  std::atomic<unsigned> turns = 0;
  for (;;) ++turns;
}

/// Until there is no more, within the limit of a real one. Addresses count, touched or not.
[[noreturn]] void bloat() {
  constexpr std::size_t kMost = std::size_t(2) << 30, kPart = 64 << 20;
  if (!sandbox::lock_down({}, {.memory_bytes = kMost})) ::_exit(5);
  std::vector<std::unique_ptr<char[]>> held;
  while (held.size() < kMost / kPart) held.push_back(std::make_unique_for_overwrite<char[]>(kPart));
  ::_exit(6);  // there was no limit
}

/// Instead of heights; true where they are to be had nevertheless.
bool misbehaves(const std::string& how, const Request& request) {
  Reply reply;
  reply.number = request.number;
  if (how == "crashes" || (how == "crashes in the east" && request.col >= 256)) ::raise(SIGSEGV);
  if (how == "ends") ::_exit(3);
  if (how == "spins") spin();
  if (how == "bloats") bloat();
  if (how == "sleeps")
    for (;;) ::pause();
  if (how == "shrinks the memory")
    return ::ftruncate(sandbox::kShared, 0) == 0 && (::raise(SIGSEGV), true);
  if (how == "answers half") return say(reply, sizeof reply / 2), true;
  if (how == "answers twice as much") return say(reply, 2 * sizeof reply), true;
  if (how == "answers another question") return ++reply.number, say(reply), true;
  if (how == "has a status of its own") return reply.status = 999, say(reply), true;
  if (how == "has a lot to say") return reply.text_bytes = 0xffffffff, say(reply), true;
  if (how == "complains at length")
    return reply.status = 1, reply.text_bytes = 1 << 20, say(reply), true;
  if (how == "counts too much") return reply.counted[3] = 0xffffffff, say(reply), true;
  if (how == "has infinite heights") {
    const double infinite = -std::numeric_limits<double>::infinity();
    std::memcpy(memory, &infinite, sizeof infinite);
    return say(reply), true;
  }
  return false;
}

int run(const std::string& how) {
  memory = static_cast<std::byte*>(::mmap(nullptr, sandbox::kSharedBytes, PROT_READ | PROT_WRITE,
                                          MAP_SHARED, sandbox::kShared, 0));
  const auto told_to = gdal::read_brief(brief());
  if (memory == MAP_FAILED || !told_to) return 8;
  if (how == "never begins") return 4;
  say({});
  std::unique_ptr<gdal::RasterFile> file;
  for (Request request; ::read(sandbox::kSocket, &request, sizeof request) == sizeof request;) {
    Reply reply;
    reply.number = request.number;
    if (request.ask == Ask::open) {
      if (how == "crashes at once") ::raise(SIGSEGV);
      auto opened = gdal::RasterFile::open(told_to->files[request.file], told_to->options,
                                           std::make_shared<gdal::IdleHandles>(0, 4));
      if (!opened) return 7;
      file = std::move(*opened);
      const std::string text = told(how, *file);
      std::memcpy(memory, text.data(), text.size());
      reply.text_bytes = std::uint32_t(text.size());
      say(reply);
      continue;
    }
    if (misbehaves(how, request)) continue;
    const std::span out(reinterpret_cast<double*>(memory),
                        std::size_t(request.cols) * std::size_t(request.rows));
    if (!file->read(request.col, request.row, request.cols, request.rows, out)) return 6;
    say(reply);
  }
  return 0;
}

}  // namespace

int main(int, char** argv) { ::_exit(run(argv[1])); }
