#include "terrain/raster/remote/http_client.h"

#include <curl/curl.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>
#include <utility>

#include "terrain/base/lower_case.h"

namespace tind::remote {

namespace {

constexpr std::size_t kBytesPerMs = 100;
constexpr std::size_t kMostHeaders = 200, kLongestHeader = 16384;

/// Connections belong to handles, so these are used again; each by one thread at a time.
class Handles {
 public:
  static Handles& all() {
    static Handles handles;
    return handles;
  }
  CURL* take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        CURL* const handle = idle_.back();
        idle_.pop_back();
        return handle;
      }
    }
    return curl_easy_init();
  }
  void give(CURL* handle) {
    curl_easy_reset(handle);
    const std::lock_guard lock(mutex_);
    if (idle_.size() < kIdle) return idle_.push_back(handle);
    curl_easy_cleanup(handle);
  }

 private:
  static constexpr std::size_t kIdle = 32;
  Handles() { curl_global_init(CURL_GLOBAL_DEFAULT); }
  ~Handles() {
    for (CURL* handle : idle_) curl_easy_cleanup(handle);
  }
  std::mutex mutex_;
  std::vector<CURL*> idle_;
};

struct Exchange {
  const HttpRequest& request;
  HttpReply reply;
  std::size_t sent = 0;
  bool too_much = false;
};

std::size_t take_body(char* data, std::size_t one, std::size_t count, void* to) {
  auto& exchange = *static_cast<Exchange*>(to);
  const std::size_t size = one * count;
  auto& body = exchange.reply.body;
  if (size > exchange.request.most_bytes - std::min(body.size(), exchange.request.most_bytes)) {
    exchange.too_much = true;
    return 0;
  }
  body.insert(body.end(), data, data + size);
  return size;
}

std::string_view trimmed(std::string_view text) {
  const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

std::size_t take_header(char* data, std::size_t one, std::size_t count, void* to) {
  auto& headers = static_cast<Exchange*>(to)->reply.headers;
  const std::string_view line(data, one * count);
  if (line.starts_with("HTTP/")) headers.clear();  // of "100 Continue" before the answer
  const std::size_t colon = line.find(':');
  if (colon == line.npos) return line.size();
  if (headers.size() >= kMostHeaders || line.size() > kLongestHeader) return 0;
  headers[lower_case(line.substr(0, colon))] = std::string(trimmed(line.substr(colon + 1)));
  return line.size();
}

std::size_t give_body(char* data, std::size_t one, std::size_t count, void* from) {
  auto& exchange = *static_cast<Exchange*>(from);
  const std::string_view rest = exchange.request.body.substr(exchange.sent);
  const std::size_t size = std::min(rest.size(), one * count);
  std::memcpy(data, rest.data(), size);
  exchange.sent += size;
  return size;
}

int seek_body(void* from, curl_off_t at, int whence) {
  auto& exchange = *static_cast<Exchange*>(from);
  if (whence != SEEK_SET || std::uint64_t(at) > exchange.request.body.size())
    return CURL_SEEKFUNC_CANTSEEK;
  exchange.sent = std::size_t(at);
  return CURL_SEEKFUNC_OK;
}

/// The URL without what may be a secret in it.
std::string shown(const std::string& url) { return url.substr(0, url.find_first_of("?#")); }

void prepare(CURL* h, Exchange& exchange, std::chrono::milliseconds patience,
             const curl_slist* headers) {
  const HttpRequest& request = exchange.request;
  const bool put = request.method == "PUT";
  const std::size_t bytes = put ? request.body.size() : request.most_bytes;
  curl_easy_setopt(h, CURLOPT_URL, request.url.c_str());
  curl_easy_setopt(h, CURLOPT_PATH_AS_IS, 1L);  // an object "a/../b" is not "b"
  curl_easy_setopt(h, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(h, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(h, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(h, CURLOPT_NETRC, long(CURL_NETRC_IGNORED));
  curl_easy_setopt(h, CURLOPT_HTTP_VERSION, long(CURL_HTTP_VERSION_1_1));
  curl_easy_setopt(h, CURLOPT_HTTP09_ALLOWED, 0L);
  curl_easy_setopt(h, CURLOPT_USERAGENT, "tind");
  if (is_loopback(request.url)) curl_easy_setopt(h, CURLOPT_PROXY, "");
  curl_easy_setopt(h, CURLOPT_CONNECTTIMEOUT_MS, long(patience.count()));
  curl_easy_setopt(h, CURLOPT_TIMEOUT_MS, long(patience.count()) + long(bytes / kBytesPerMs));
  // Silence for that long is the end, however large the answer was to be.
  curl_easy_setopt(h, CURLOPT_LOW_SPEED_LIMIT, 100L);
  curl_easy_setopt(h, CURLOPT_LOW_SPEED_TIME, std::max(1L, long(patience.count() / 1000)));
  curl_easy_setopt(h, CURLOPT_HTTPHEADER, headers);
  curl_easy_setopt(h, CURLOPT_WRITEFUNCTION, take_body);
  curl_easy_setopt(h, CURLOPT_WRITEDATA, &exchange);
  curl_easy_setopt(h, CURLOPT_HEADERFUNCTION, take_header);
  curl_easy_setopt(h, CURLOPT_HEADERDATA, &exchange);
  if (request.method == "HEAD") curl_easy_setopt(h, CURLOPT_NOBODY, 1L);
  if (request.method == "DELETE") curl_easy_setopt(h, CURLOPT_CUSTOMREQUEST, "DELETE");
  if (!put) return;
  curl_easy_setopt(h, CURLOPT_UPLOAD, 1L);
  curl_easy_setopt(h, CURLOPT_INFILESIZE_LARGE, curl_off_t(request.body.size()));
  curl_easy_setopt(h, CURLOPT_READFUNCTION, give_body);
  curl_easy_setopt(h, CURLOPT_READDATA, &exchange);
  curl_easy_setopt(h, CURLOPT_SEEKFUNCTION, seek_body);
  curl_easy_setopt(h, CURLOPT_SEEKDATA, &exchange);
}

}  // namespace

std::string HttpReply::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string() : found->second;
}

bool is_loopback(std::string_view url) {
  const std::size_t slashes = url.find("://");
  if (slashes == url.npos) return false;
  std::string_view host = url.substr(slashes + 3);
  host = host.substr(0, host.find_first_of("/?#"));
  if (host.find('@') != host.npos) return false;
  if (host.starts_with("[::1]")) return host.size() == 5 || host[5] == ':';
  host = host.substr(0, host.find(':'));
  if (host == "localhost") return true;
  return host.starts_with("127.") && host.find_first_not_of("0123456789.") == host.npos;
}

Result<HttpReply> ask(const HttpRequest& request, std::chrono::milliseconds patience) {
  CURL* const handle = Handles::all().take();
  if (!handle) return fail(Errc::io, "no memory to ask a server");
  const std::unique_ptr<CURL, void (*)(CURL*)> given_back(handle,
                                                          [](CURL* h) { Handles::all().give(h); });
  curl_slist* list = nullptr;
  for (const std::string& header : request.headers) list = curl_slist_append(list, header.c_str());
  list = curl_slist_append(list, "Expect:");  // else every PUT waits a second for old servers
  const std::unique_ptr<curl_slist, void (*)(curl_slist*)> headers(list, curl_slist_free_all);
  Exchange exchange{request, {}};
  prepare(handle, exchange, patience, headers.get());
  const CURLcode code = curl_easy_perform(handle);
  if (exchange.too_much)
    return fail(Errc::out_of_range, shown(request.url) + ": a larger answer than was asked for");
  if (code != CURLE_OK) return fail(Errc::io, shown(request.url) + ": " + curl_easy_strerror(code));
  long status = 0;
  curl_easy_getinfo(handle, CURLINFO_RESPONSE_CODE, &status);
  exchange.reply.status = int(status);
  return std::move(exchange.reply);
}

}  // namespace tind::remote
