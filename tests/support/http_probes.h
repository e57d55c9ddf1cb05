#pragma once
// Requests, byte by byte, and what must become of them: the malformed ones of every class that has
// been used against HTTP servers (request smuggling, header injection, resource exhaustion), and
// the unusual ones that are right. One table for the parser alone and for the server over a socket.

#include <string>
#include <vector>

namespace tind::test {

struct Probe {
  std::string name, bytes;
  int status;  // >= 400: refused with this by the parser; 200: a request that the parser accepts
};

const std::vector<Probe>& probes();

}  // namespace tind::test
