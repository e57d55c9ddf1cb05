// Any bytes: no crash, and nothing that does not end as a PNG does is whole.

#include <cstdint>
#include <cstdlib>

#include "proto/image/png.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (!tind::proto::is_whole_png(bytes)) return 0;
  if (!bytes.ends_with(std::string_view("IEND\xae\x42\x60\x82", 8))) std::abort();
  if (tind::proto::is_whole_png(bytes.substr(0, size - 1))) std::abort();
  return 0;
}
