#include "terrain/base/errno_text.h"

#include <cstring>

namespace tind {

std::string errno_text(int code) {
  char place[256];
  return ::strerror_r(code, place, sizeof place);  // GNU's: the text, which need not be in `place`
}

}  // namespace tind
