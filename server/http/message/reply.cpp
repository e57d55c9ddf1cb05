#include "server/http/message/reply.h"

namespace tind::http {
namespace {

struct Reason {
  int status;
  std::string_view phrase;
};

constexpr Reason kReasons[] = {
    {100, "Continue"},
    {200, "OK"},
    {201, "Created"},
    {204, "No Content"},
    {206, "Partial Content"},
    {304, "Not Modified"},
    {308, "Permanent Redirect"},
    {400, "Bad Request"},
    {401, "Unauthorized"},
    {403, "Forbidden"},
    {404, "Not Found"},
    {405, "Method Not Allowed"},
    {408, "Request Timeout"},
    {411, "Length Required"},
    {412, "Precondition Failed"},
    {413, "Content Too Large"},
    {414, "URI Too Long"},
    {415, "Unsupported Media Type"},
    {416, "Range Not Satisfiable"},
    {417, "Expectation Failed"},
    {422, "Unprocessable Content"},
    {429, "Too Many Requests"},
    {431, "Request Header Fields Too Large"},
    {500, "Internal Server Error"},
    {501, "Not Implemented"},
    {502, "Bad Gateway"},
    {503, "Service Unavailable"},
    {505, "HTTP Version Not Supported"},
};

void add(std::string& bytes, std::string_view name, std::string_view value) {
  bytes.append(name).append(": ").append(value).append("\r\n");
}

void add_head(Payload& payload, std::string_view content_type, const std::vector<Header>& headers,
              bool has_body, std::size_t body_size) {
  std::string& bytes = payload.bytes;
  if (has_body && !content_type.empty()) add(bytes, "Content-Type", content_type);
  if (has_body) add(bytes, "Content-Length", std::to_string(body_size));
  for (const auto& [name, value] : headers) add(bytes, name, value);
  add(bytes, "X-Content-Type-Options", "nosniff");
  bytes.append("\r\n");
  payload.head = bytes.size();
}

}  // namespace

std::string_view reason(int status) {
  for (const Reason& entry : kReasons)
    if (entry.status == status) return entry.phrase;
  return "Unknown";
}

std::shared_ptr<Payload> make_payload(int status, std::string_view content_type,
                                      const std::vector<Header>& headers, std::string_view body) {
  auto payload = std::make_shared<Payload>();
  payload->bytes.reserve(320 + body.size());
  const bool has_body = status != 204 && status != 304;
  add_head(*payload, content_type, headers, has_body, body.size());
  if (has_body) payload->bytes.append(body);
  return payload;
}

Reply make_reply(int status, std::string_view content_type, std::string_view body,
                 const std::vector<Header>& headers) {
  return {status, make_payload(status, content_type, headers, body), false};
}

Reply make_reply(std::string_view content_type, std::vector<Piece> pieces,
                 const std::vector<Header>& headers) {
  auto payload = std::make_shared<Payload>();
  std::size_t size = 0;
  for (const Piece& piece : pieces) size += piece.bytes.size();
  add_head(*payload, content_type, headers, true, size);
  payload->pieces = std::move(pieces);
  return {200, std::move(payload), false};
}

}  // namespace tind::http
