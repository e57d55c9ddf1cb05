#include "terrain/raster/remote/aws_signature.h"

#include <algorithm>
#include <ctime>

#include "terrain/base/sha256.h"

namespace tind::remote {

namespace {

constexpr std::size_t kBlock = 64;  // of SHA-256

std::string hash_text(std::string_view text) { return hex_of(sha256(text)); }

/// RFC 2104.
std::string hmac(std::string_view key, std::string_view text) {
  const auto raw = [](std::string_view what) {
    const Sha256 hash = sha256(what);
    return std::string(hash.begin(), hash.end());
  };
  std::string padded(key.size() > kBlock ? raw(key) : std::string(key));
  padded.resize(kBlock, '\0');
  std::string inner = padded, outer = padded;
  for (char& c : inner) c = char(c ^ 0x36);
  for (char& c : outer) c = char(c ^ 0x5c);
  return raw(outer + raw(inner.append(text)));
}

std::string hex_text(std::string_view bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    const auto b = static_cast<unsigned char>(c);
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

std::string time_text(std::int64_t seconds) {
  const std::time_t time = seconds;
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  char text[32] = {};
  const std::size_t size = std::strftime(text, sizeof text, "%Y%m%dT%H%M%SZ", &parts);
  return {text, size};
}

}  // namespace

std::string uri_encode(std::string_view text, bool keep_slashes) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto b = static_cast<unsigned char>(c);
    const bool plain = (b >= 'A' && b <= 'Z') || (b >= 'a' && b <= 'z') || (b >= '0' && b <= '9') ||
                       c == '-' || c == '.' || c == '_' || c == '~' || (c == '/' && keep_slashes);
    if (plain) {
      out += c;
      continue;
    }
    out += '%';
    out += kDigits[b >> 4];
    out += kDigits[b & 15];
  }
  return out;
}

std::string query_text(const std::vector<std::pair<std::string, std::string>>& query) {
  std::vector<std::string> parts;
  parts.reserve(query.size());
  for (const auto& [name, value] : query)
    parts.push_back(uri_encode(name, false) + "=" + uri_encode(value, false));
  std::ranges::sort(parts);
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "?" : "&") + part;
  return text;
}

std::vector<std::string> signed_headers(const AwsRequest& request, const AwsKey& key,
                                        const std::string& region, std::int64_t seconds) {
  const std::string now = time_text(seconds), day = now.substr(0, 8),
                    body = hash_text(request.body);
  auto headers = request.headers;
  headers.emplace_back("host", request.host);
  headers.emplace_back("x-amz-content-sha256", body);
  headers.emplace_back("x-amz-date", now);
  if (!key.session.empty()) headers.emplace_back("x-amz-security-token", key.session);
  std::ranges::sort(headers);
  std::string lines, names;
  for (const auto& [name, value] : headers) {
    lines.append(name).append(":").append(value).append("\n");
    names.append(names.empty() ? "" : ";").append(name);
  }
  std::string query = query_text(request.query);
  if (!query.empty()) query.erase(0, 1);
  const std::string canonical = request.method + "\n" + request.path + "\n" + query + "\n" + lines +
                                "\n" + names + "\n" + body;
  const std::string scope = day + "/" + region + "/s3/aws4_request";
  const std::string to_sign =
      "AWS4-HMAC-SHA256\n" + now + "\n" + scope + "\n" + hash_text(canonical);
  const std::string signing =
      hmac(hmac(hmac(hmac("AWS4" + key.secret, day), region), "s3"), "aws4_request");
  std::vector<std::string> out;
  out.reserve(headers.size() + 1);
  for (const auto& [name, value] : headers) out.push_back(name + ": " + value);
  out.push_back("Authorization: AWS4-HMAC-SHA256 Credential=" + key.id + "/" + scope +
                ",SignedHeaders=" + names + ",Signature=" + hex_text(hmac(signing, to_sign)));
  return out;
}

}  // namespace tind::remote
