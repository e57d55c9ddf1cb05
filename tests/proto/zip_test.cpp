// Zip: what no small archive shows. (tests/clients/archive.test.mjs reads whole ones.)

#include "proto/zip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <random>
#include <vector>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"
#include "tests/support/support.h"

namespace tind::proto {
namespace {

/// What Python's zipfile prints of an archive: its number of entries, and the content of the last.
std::string read_by_python(const std::string& path) {
  const std::string command =
      "/usr/bin/python3 -c \"import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); n = "
      "z.namelist(); print(len(n), n[-1], z.read(n[-1]).decode())\" " +
      path;
  std::string said;
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 256> text;
  while (pipe && std::fgets(text.data(), int(text.size()), pipe)) said += text.data();
  if (pipe) pclose(pipe);
  return said;
}

ZipEntry stored(const std::string& name, const std::string& bytes, std::uint64_t offset) {
  const auto size = std::uint32_t(bytes.size());
  return {name, ZipMethod::stored, crc32(bytes), size, size, offset};
}

TEST(Zip, MoreEntriesThan16BitsCount) {
  const test::TempDir folder;
  std::string archive;
  std::vector<ZipEntry> entries;
  for (int i = 0; i < 70'000; ++i) {
    entries.push_back(stored("f" + std::to_string(i), "x", archive.size()));
    archive += encode_local_header(entries.back()) + "x";
  }
  archive += encode_directory(entries, archive.size());
  const auto where =
      find_directory(std::string_view(archive).substr(archive.size() - kZipTail), archive.size());
  ASSERT_TRUE(where) << where.error().what;
  EXPECT_EQ(where->entries, 70'000u);
  const auto back = decode_directory(std::string_view(archive).substr(where->offset, where->size));
  ASSERT_TRUE(back) << back.error().what;
  ASSERT_EQ(back->size(), entries.size());
  EXPECT_EQ(back->back().name, "f69999");
  EXPECT_EQ(back->back().offset, entries.back().offset);
  std::ofstream(folder.file("many.zip"), std::ios::binary) << archive;
  EXPECT_EQ(read_by_python(folder.file("many.zip")), "70000 f69999 x\n");
}

TEST(Zip, EntriesBeyond4GiB) {
  const test::TempDir folder;  // the file has a hole, which takes no room on the disk
  constexpr std::uint64_t kFar = 5'000'000'000;
  const std::string head = "near", tail = "far away";
  const std::vector<ZipEntry> entries = {stored("a", head, 0), stored("b", tail, kFar)};
  const std::string far = encode_local_header(entries[1]) + tail;
  {
    std::ofstream out(folder.file("far.zip"), std::ios::binary);
    out << encode_local_header(entries[0]) << head;
    out.seekp(std::streamoff(kFar));
    out << far << encode_directory(entries, kFar + far.size());
  }
  const std::string directory = encode_directory(entries, kFar + far.size());
  const auto where = find_directory(directory, kFar + far.size() + directory.size());
  ASSERT_TRUE(where) << where.error().what;
  EXPECT_EQ(where->offset, kFar + far.size());
  const auto back = decode_directory(std::string_view(directory).substr(0, where->size));
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(back->at(1).offset, kFar);
  EXPECT_EQ(read_by_python(folder.file("far.zip")), "2 b far away\n");
}

TEST(Zip, TheIndexIsInTheOrderOfTheHashes) {
  std::vector<ZipEntry> entries;
  for (int i = 0; i < 100; ++i)
    entries.push_back(stored(std::to_string(i), "", 1000u + unsigned(i)));
  const std::string index = encode_3tz_index(entries);
  ASSERT_EQ(index.size(), 2400u);
  std::vector<bool> seen(100);
  std::pair<std::uint64_t, std::uint64_t> before;
  for (std::size_t at = 0; at < index.size(); at += 24) {
    const std::pair hash{load<std::uint64_t>(index.data() + at),
                         load<std::uint64_t>(index.data() + at + 8)};
    EXPECT_LT(before, hash);
    before = hash;
    seen[load<std::uint64_t>(index.data() + at + 16) - 1000] = true;
  }
  EXPECT_EQ(std::ranges::count(seen, true), 100);
}

TEST(Zip, ADirectoryIsBelievedNoFartherThanItReaches) {
  std::vector<ZipEntry> entries;
  for (int i = 0; i < 5; ++i)
    entries.push_back(stored("f" + std::to_string(i), "x", 0x100000000u * unsigned(i % 2)));
  const std::string whole = encode_directory(entries, 0x200000000u);
  std::mt19937 random(1);
  int good = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = whole.substr(0, round % 2 ? random() % whole.size() : whole.size());
    for (int i = 0; i < 3 && !bytes.empty(); ++i) bytes[random() % bytes.size()] = char(random());
    const auto where = find_directory(bytes, 0x200000000u + whole.size());
    if (where) {
      EXPECT_LE(where->offset + where->size, 0x200000000u + whole.size());
    }
    const auto back = decode_directory(bytes);
    good += back.has_value();
    (void)local_header_size(bytes);
  }
  EXPECT_LT(good, 100);
  EXPECT_FALSE(find_directory("", 0));
}

}  // namespace
}  // namespace tind::proto
