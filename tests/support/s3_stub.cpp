#include "tests/support/s3_stub.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>

#include "terrain/base/md5.h"
#include "terrain/base/sha256.h"

namespace tind {

struct S3Stub::Request {
  std::string kind, path, query, body;  // path: "bucket/key"
  std::map<std::string, std::string> headers;

  std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
};

namespace {

std::string hex(const std::array<std::uint8_t, 16>& hash) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t b : hash) {
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

std::string base64(const std::array<std::uint8_t, 16>& hash) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  unsigned bits = 0, held = 0;
  for (const std::uint8_t b : hash) {
    bits = bits << 8 | b, held += 8;
    while (held >= 6) text += kLetters[bits >> (held -= 6) & 63];
  }
  return text + kLetters[bits << (6 - held) & 63] + "==";
}

std::string decoded(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size()) {
      out += char(std::stoi(text.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::string parameter(const std::string& query, const std::string& name) {
  const std::string wanted = "&" + name + "=", all = "&" + query;
  const std::size_t at = all.find(wanted);
  if (at == all.npos) return "";
  const std::size_t begin = at + wanted.size();
  return decoded(all.substr(begin, all.find('&', begin) - begin));
}

bool send_all(int socket, const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = ::send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += std::size_t(n);
  }
  return true;
}

std::string reply(int status, const std::string& headers, const std::string& body) {
  return "HTTP/1.1 " + std::to_string(status) + " As said\r\n" + headers +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

std::string error_body(const std::string& code) {
  return "<?xml version=\"1.0\"?><Error><Code>" + code + "</Code></Error>";
}

}  // namespace

S3Stub::S3Stub() {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener_, 64) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    std::abort();
  port_ = ntohs(address.sin_port);
  acceptor_ = std::thread([this] { accept_all(); });
}

S3Stub::~S3Stub() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    for (const int socket : open_) ::shutdown(socket, SHUT_RDWR);
  }
  ::shutdown(listener_, SHUT_RDWR);
  acceptor_.join();
  for (std::thread& thread : threads_) thread.join();
  ::close(listener_);
}

void S3Stub::accept_all() {
  for (;;) {
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const std::lock_guard lock(mutex_);
    if (stopping_) {
      if (socket >= 0) ::close(socket);
      return;
    }
    if (socket < 0) continue;
    open_.push_back(socket);
    threads_.emplace_back([this, socket] { serve(socket); });
  }
}

void S3Stub::serve(int socket) {
  std::string input;
  for (bool open = true; open;) {
    std::size_t end = 0, length = 0;
    Request request;
    for (;;) {
      end = input.find("\r\n\r\n");
      if (end != input.npos) {
        request = {};
        std::size_t at = input.find("\r\n");
        const std::string first = input.substr(0, at);
        request.kind = first.substr(0, first.find(' '));
        std::string target = first.substr(request.kind.size() + 1);
        target = target.substr(0, target.find(' '));
        request.path = decoded(target.substr(1, target.find('?') - 1));
        if (target.find('?') != target.npos) request.query = target.substr(target.find('?') + 1);
        while (at < end) {
          const std::size_t next = input.find("\r\n", at + 2);
          const std::string line = input.substr(at + 2, next - at - 2);
          std::string name = line.substr(0, line.find(':'));
          std::ranges::transform(name, name.begin(),
                                 [](unsigned char c) { return char(std::tolower(c)); });
          request.headers[name] = line.substr(std::min(line.size(), line.find(':') + 2));
          at = next;
        }
        length = std::size_t(std::atoll(request.header("content-length").c_str()));
        if (input.size() >= end + 4 + length) break;
      }
      char bytes[65536];
      const ssize_t n = ::recv(socket, bytes, sizeof bytes, 0);
      if (n <= 0) {
        open = false;
        break;
      }
      input.append(bytes, std::size_t(n));
    }
    if (!open) break;
    request.body = input.substr(end + 4, length);
    input.erase(0, end + 4 + length);
    if (request.kind == "GET" && request.query.find("list-type") != request.query.npos)
      request.kind = "LIST";
    open = answer(socket, request);
  }
  const std::lock_guard lock(mutex_);
  std::erase(open_, socket);
  ::close(socket);
}

bool S3Stub::plan_for(const Request& request, Fault& fault) {
  for (Plan& plan : plans_)
    if (plan.left > 0 && plan.kind == request.kind &&
        (request.path + "?" + decoded(request.query)).find(plan.part) != std::string::npos) {
      --plan.left;
      fault = plan.fault;
      return true;
    }
  return false;
}

std::string S3Stub::list(const Request& request) const {
  const std::string bucket = request.path.substr(0, request.path.find('/')) + "/";
  const std::string prefix = bucket + parameter(request.query, "prefix");
  const std::string after = parameter(request.query, "continuation-token");
  constexpr int kPage = 50;  // so that lists have pages
  std::string body = "<?xml version=\"1.0\"?><ListBucketResult>", last;
  int count = 0;
  bool more = false;
  for (const auto& [path, bytes] : objects_) {
    if (!path.starts_with(prefix) || path <= after) continue;
    if (count++ == kPage) {
      more = true;
      break;
    }
    body += "<Contents><Key>" + path.substr(bucket.size()) + "</Key><ETag>&quot;" +
            hex(md5(bytes)) + "&quot;</ETag><Size>" + std::to_string(bytes.size()) +
            "</Size></Contents>";
    last = path;
  }
  body += std::string("<IsTruncated>") + (more ? "true" : "false") + "</IsTruncated>";
  if (more) body += "<NextContinuationToken>" + last + "</NextContinuationToken>";
  return body + "</ListBucketResult>";
}

bool S3Stub::answer(int socket, const Request& request) {
  Fault fault{};
  bool faulty = false, found = false;
  std::string bytes;
  {
    const std::lock_guard lock(mutex_);
    ++counts_[request.kind];
    faulty = plan_for(request, fault);
    const auto it = objects_.find(request.path);
    found = it != objects_.end();
    if (found) bytes = it->second;
  }
  const auto is = [&](Fault one) { return faulty && fault == one; };
  const bool head = request.kind == "HEAD";
  const auto send = [&](const std::string& text) {
    return send_all(socket, head ? text.substr(0, text.find("\r\n\r\n") + 4) : text);
  };
  if (is(Fault::e500)) return send(reply(500, "", error_body("InternalError")));
  if (is(Fault::e503)) return send(reply(503, "", error_body("SlowDown")));
  if (is(Fault::e403)) return send(reply(403, "", error_body("AccessDenied")));
  if (is(Fault::redirect)) return send(reply(307, "Location: http://127.0.0.1:9/x\r\n", ""));
  if (is(Fault::error_200)) return send(reply(200, "", error_body("InternalError")));
  if (is(Fault::reset)) {
    const linger now{1, 0};
    ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    return false;
  }
  if (is(Fault::hang)) {
    char byte;
    ::recv(socket, &byte, 1, 0);
    return false;
  }
  if (request.kind == "PUT") {
    const bool sound = request.header("content-md5") == base64(md5(request.body)) &&
                       request.header("x-amz-content-sha256") == hex_of(sha256(request.body)) &&
                       !request.header("authorization").empty();
    const std::lock_guard lock(mutex_);
    if (!sound) {
      ++wrong_digests_;
      return send(reply(400, "", error_body("BadDigest")));
    }
    if (is(Fault::half_done))
      objects_[request.path] = request.body.substr(0, request.body.size() / 2);
    else if (!is(Fault::lie))
      objects_[request.path] = request.body;
    if (is(Fault::lost)) return false;
    return send(reply(200, "ETag: \"" + hex(md5(request.body)) + "\"\r\n", ""));
  }
  if (request.kind == "DELETE") {
    const std::lock_guard lock(mutex_);
    objects_.erase(request.path);
    return send("HTTP/1.1 204 Gone\r\n\r\n");
  }
  if (request.kind == "LIST") {
    std::string body;
    {
      const std::lock_guard lock(mutex_);
      body = list(request);
    }
    if (is(Fault::short_body)) body.resize(body.size() / 2);
    const std::string text = reply(200, "", body);
    if (is(Fault::cut)) return send(text.substr(0, text.size() / 2)), false;
    return send(text);
  }
  if (!found) return send(reply(404, "", error_body("NoSuchKey")));
  const std::string etag = "\"" + hex(md5(bytes)) + "\"";
  std::string headers = "ETag: " + etag +
                        "\r\nLast-Modified: Thu, 01 Jan 2026 00:00:00 GMT\r\nAccept-Ranges: "
                        "bytes\r\n";
  const std::string if_match = request.header("if-match");
  if (!if_match.empty() && if_match != etag)
    return send(reply(412, "", error_body("PreconditionFailed")));
  int status = 200;
  const std::string range = request.header("range");
  const std::size_t whole = bytes.size();
  if (!range.empty() && !is(Fault::no_range)) {
    std::size_t first = std::size_t(std::atoll(range.c_str() + 6));
    std::size_t last = std::size_t(std::atoll(range.c_str() + range.find('-') + 1));
    if (is(Fault::wrong_range)) ++first, ++last;
    if (first >= whole) return send(reply(416, "", ""));
    last = std::min(last, whole - 1);
    bytes = bytes.substr(first, last - first + 1);
    headers += "Content-Range: bytes " + std::to_string(first) + "-" + std::to_string(last) + "/" +
               std::to_string(whole) + "\r\n";
    status = 206;
  }
  if (is(Fault::short_body)) bytes.resize(bytes.size() / 2);
  if (is(Fault::other_body) && !bytes.empty()) bytes[bytes.size() / 2] ^= 1;
  if (is(Fault::cut)) {
    std::string text = reply(status, headers, bytes);
    text.resize(text.size() - bytes.size() / 2 - 1);
    send(text);
    return false;
  }
  if (is(Fault::no_length)) {
    send("HTTP/1.1 " + std::to_string(status) + " OK\r\n" + headers + "\r\n" +
         bytes.substr(0, bytes.size() / 2));
    return false;
  }
  return send(reply(status, headers, bytes));
}

void S3Stub::fail_next(const std::string& kind, Fault fault, int times, const std::string& part) {
  const std::lock_guard lock(mutex_);
  plans_.push_back({kind, part, fault, times});
}

void S3Stub::mend() {
  const std::lock_guard lock(mutex_);
  plans_.clear();
}

std::map<std::string, std::string> S3Stub::objects() const {
  const std::lock_guard lock(mutex_);
  return objects_;
}

void S3Stub::put(const std::string& path, std::string bytes) {
  const std::lock_guard lock(mutex_);
  objects_[path] = std::move(bytes);
}

void S3Stub::erase(const std::string& path) {
  const std::lock_guard lock(mutex_);
  objects_.erase(path);
}

int S3Stub::count(const std::string& kind) const {
  const std::lock_guard lock(mutex_);
  const auto found = counts_.find(kind);
  return found == counts_.end() ? 0 : found->second;
}

int S3Stub::wrong_digests() const {
  const std::lock_guard lock(mutex_);
  return wrong_digests_;
}

namespace {
constexpr const char* kNames[] = {"AWS_ENDPOINT_URL", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY",
                                  "TIND_REMOTE_TIMEOUT", "TIND_REMOTE_TRIES"};
}

S3Environment::S3Environment(const S3Stub& stub, int seconds, int tries) {
  const std::string values[] = {stub.address(), "key", "secret", std::to_string(seconds),
                                std::to_string(tries)};
  for (std::size_t i = 0; i < std::size(kNames); ++i) ::setenv(kNames[i], values[i].c_str(), 1);
}

S3Environment::~S3Environment() {
  for (const char* name : kNames) ::unsetenv(name);
}

}  // namespace tind
