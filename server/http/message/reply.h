#pragma once
// What goes back: a status, and headers with body serialised once into immutable bytes that any
// number of connections may be sending at the same time.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tind::http {

using Header = std::pair<std::string_view, std::string_view>;

struct Payload;

/// Bytes that somebody else has, and whom to keep for their sake.
struct Piece {
  std::shared_ptr<const Payload> owner;
  std::string_view bytes;
};

/// Everything of a response but its status line, Date and Connection: "Name: value" lines, the
/// empty line, the body. What follows `bytes` is sent from where it lies already.
struct Payload {
  std::string bytes;
  std::size_t head = 0;       // bytes before the body
  std::vector<Piece> pieces;  // the body goes on with these
  bool shared = false;        // kept for many clients, not made for one

  std::string_view body() const { return std::string_view(bytes).substr(head); }
  /// What it takes itself, without the owners of its pieces.
  std::size_t memory_bytes() const {
    return sizeof(Payload) + bytes.capacity() + pieces.capacity() * sizeof(Piece);
  }
};

struct Reply {
  int status = 500;
  std::shared_ptr<const Payload> payload;
  bool close = false;           // end the connection after it
  std::string request_id = {};  // of a problem, for the log
};

/// Adds Content-Length (not for 204 and 304, which have no body) and what every response carries:
/// no sniffing of content types. For which origins it is, the connection says.
std::shared_ptr<Payload> make_payload(int status, std::string_view content_type,
                                      const std::vector<Header>& headers, std::string_view body);

Reply make_reply(int status, std::string_view content_type, std::string_view body,
                 const std::vector<Header>& headers = {});

/// A 200 whose body is these pieces, one after the other.
Reply make_reply(std::string_view content_type, std::vector<Piece> pieces,
                 const std::vector<Header>& headers = {});

/// "Not Found" for 404.
std::string_view reason(int status);

}  // namespace tind::http
