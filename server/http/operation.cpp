#include "server/http/operation.h"

#include <cassert>

namespace tind::http {

std::string_view name(Scope scope) {
  switch (scope) {
    case Scope::open:
      return "open";
    case Scope::tiles:
      return "tiles";
    case Scope::read:
      return "read";
    case Scope::jobs:
      return "jobs";
    case Scope::admin:
      return "admin";
  }
  return "admin";
}

QueryNumbers read_query(const Request& request) {
  assert(request.operation);
  return read_numbers(request.head.query, request.operation->numbers, request.operation->words);
}

}  // namespace tind::http
