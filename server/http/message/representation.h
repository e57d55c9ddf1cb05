#pragma once
// One resource, ready to send: as it is, compressed, and "you have it already".

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/negotiate.h"
#include "server/http/message/reply.h"
#include "server/http/message/request_parser.h"

namespace tind::http {

/// Immutable once made, so that any number of connections may send it at the same time. Three
/// payloads with their headers: 200, 200 with Content-Encoding: gzip (absent where that saves
/// nothing), and 304 for each of the two. ETags are strong: a hash of the plain bytes, with a
/// suffix for the compressed form. Parts of the body (206) are cut when they are asked for.
class Representation {
 public:
  struct Options {
    std::string_view content_type;
    std::string_view cache_control = "no-cache";
    std::string_view vary = "Accept-Encoding";
    bool compress = true;
    bool ranges = false;              // parts may be asked for; only without `compress`
    std::vector<Header> fields = {};  // of its own; seen by make() alone
  };
  /// Compresses here, so: not on an I/O thread for large bodies.
  static std::shared_ptr<const Representation> make(std::string_view body, const Options&);

  /// What this client gets.
  Reply reply(const Conditions&) const;
  Reply reply(const Fields& fields) const { return reply(Conditions(fields)); }

  /// The first `bytes` of the body as a resource of its own, with the same headers but its ETag.
  /// REQUIRES: not made to be compressed; at most the whole.
  std::shared_ptr<const Representation> beginning(std::size_t bytes) const;

  std::string_view body() const { return plain_->body(); }
  /// The same, for what decodes it.
  std::span<const std::uint8_t> bytes() const {
    return {reinterpret_cast<const std::uint8_t*>(body().data()), body().size()};
  }
  /// The body as a part of another response.
  Piece piece() const { return {plain_, body()}; }
  std::string_view etag() const { return etag_; }
  std::size_t memory_bytes() const { return memory_; }

 private:
  std::string etag_, gzip_etag_;
  std::shared_ptr<const Payload> plain_, gzip_, plain_304_, gzip_304_;
  std::size_t memory_ = 0;
  bool ranges_ = false;
  std::string content_type_, cache_control_, vary_;

  std::vector<Header> headers(std::string_view etag) const;
  Reply part(std::string_view range) const;
};

/// The answer (412) to Conditions that exclude what is there.
Reply changed(std::string_view target = {});

}  // namespace tind::http
