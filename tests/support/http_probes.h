#pragma once
// Requests, byte by byte, and what must become of them: the malformed ones of every class that has
// been used against HTTP servers (request smuggling, header injection, resource exhaustion), and
// the unusual ones that are right. One table, testdata/http_probes.txt, for the parser alone, for
// the server over a socket, and for the release program and other servers (scripts/campaign).

#include <string>
#include <vector>

namespace tind::test {

struct Probe {
  std::string name;
  std::string clause;  // of RFC 9110 or 9112: "9112 3.2"
  int status;          // >= 400: refused with this by the parser; 200: a request that it accepts
  std::string bytes;
};

const std::vector<Probe>& probes();

}  // namespace tind::test
