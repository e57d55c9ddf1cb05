// Any bytes: no crash, and nothing that does not end as our WebP does is whole.

#include <cstdint>
#include <cstdlib>

#include "proto/image/webp.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (!tind::proto::is_whole_webp(bytes)) return 0;
  if (bytes.substr(size - 12, 4) != "TCRC") std::abort();
  if (tind::proto::is_whole_webp(bytes.substr(0, size - 1))) std::abort();
  return 0;
}
