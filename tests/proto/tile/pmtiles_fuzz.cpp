// Any bytes as the header and as a directory of a PMTiles archive: an error with a reason, or what
// is written back to the same; sections do not wrap, numbers ascend.

#include "proto/tile/pmtiles.h"
#include "tests/support/fuzz_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  using tind::test::require;
  const auto header = decode_pmtiles_header({data, size});
  if (header) {
    for (const auto& part : {header->root, header->metadata, header->leaves, header->tiles})
      require(part.end() >= part.at, "a section wraps");
    const std::string bytes = encode_pmtiles_header(*header);
    const auto again =
        decode_pmtiles_header({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    require(again && *again == *header, "another header when written");
  } else {
    require(!header.error().what.empty(), "no reason");
  }
  const auto entries = decode_pmtiles_directory({data, size});
  if (!entries) {
    require(!entries.error().what.empty(), "no reason");
    return 0;
  }
  require(entries->size() <= size, "more entries than bytes");
  for (std::size_t i = 0; i < entries->size(); ++i) {
    const PmtilesEntry& e = (*entries)[i];
    require(i == 0 || e.number > (*entries)[i - 1].number, "numbers do not ascend");
    if (const auto place = pmtiles_place(e.number))
      require(pmtiles_number(*place) == e.number, "another place");
  }
  const std::string bytes = encode_pmtiles_directory(*entries);
  const auto again =
      decode_pmtiles_directory({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  require(again && *again == *entries, "another directory when written");
  return 0;
}
