// Judging an answer is all of the work. A range counts when the status is 206 and Content-Range
// names exactly the bytes that were asked for, of an object of the known size; the version is held
// against the reply's own ETag even where the server was asked to do so (If-Match), since not every
// one does.

#include "terrain/raster/remote/objects.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <utility>

#include "terrain/base/lower_case.h"
#include "terrain/base/md5.h"

namespace tind::remote {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kErrorBytes = 64u << 10u;  // of an answer that says why not
constexpr std::size_t kListBytes = 8u << 20u;    // of a page of 1000 names
constexpr std::uint64_t kMostPut = 5ull << 30u;  // S3 takes no more at once

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

bool says_no(std::string_view said) {
  const std::string text = lower_case(said);
  return text == "no" || text == "false" || text == "0" || text == "off";
}

std::optional<std::uint64_t> number_of(std::string_view text) {
  std::uint64_t n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return {};
  return n;
}

std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

std::string hex_md5(std::string_view bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t b : md5(bytes)) {
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}

std::string base64_md5(std::string_view bytes) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto hash = md5(bytes);
  std::string text;
  for (std::size_t i = 0; i < hash.size(); i += 3) {
    const auto byte = [&](std::size_t k) { return k < hash.size() ? hash[k] : 0u; };
    const unsigned three = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (int k = 3; k >= 0; --k) text += kLetters[three >> (6 * k) & 63];
  }
  text.resize(22);  // 16 bytes
  return text + "==";
}

/// What stands between <tag> and </tag>; nothing where there is none.
std::optional<std::string_view> between(std::string_view xml, const std::string& tag,
                                        std::size_t from = 0) {
  const std::size_t open = xml.find("<" + tag + ">", from);
  if (open == xml.npos) return {};
  const std::size_t begin = open + tag.size() + 2;
  const std::size_t end = xml.find("</" + tag + ">", begin);
  if (end == xml.npos) return {};
  return xml.substr(begin, end - begin);
}

std::string unescaped(std::string_view xml) {
  constexpr std::pair<std::string_view, char> kNames[] = {
      {"&amp;", '&'},   {"&lt;", '<'},  {"&gt;", '>'},  {"&quot;", '"'},
      {"&apos;", '\''}, {"&#34;", '"'}, {"&#39;", '\''}};
  std::string text;
  while (!xml.empty()) {
    const auto name =
        std::ranges::find_if(kNames, [&](const auto& one) { return xml.starts_with(one.first); });
    if (name == std::end(kNames)) {
      text += xml.front();
      xml.remove_prefix(1);
    } else {
      text += name->second;
      xml.remove_prefix(name->first.size());
    }
  }
  return text;
}

/// The word by which an S3 store says why not, made harmless.
std::string code_in(const Bytes& body) {
  const std::string text = text_of(body);
  const auto code = between(text, "Code");
  if (!code || code->size() > 64) return "";
  const auto letter = [](unsigned char c) { return std::isalnum(c) != 0; };
  return std::ranges::all_of(*code, letter) ? std::string(*code) : "";
}

bool may_pass(int status) { return status >= 500 || status == 429 || status == 408; }

/// Why an answer is none of those that were hoped for.
std::unexpected<Error> refusal(const std::string& url, const HttpReply& reply) {
  const std::string code = code_in(reply.body);
  const std::string said =
      "status " + std::to_string(reply.status) + (code.empty() ? "" : " (" + code + ")");
  switch (reply.status) {
    case 404:
    case 410:
      return fail(Errc::not_found, url + " is not there: " + said);
    case 412:
      return fail(Errc::busy, url + " is another than when it was opened: ask again in a moment");
    case 401:
    case 403:
      return fail(Errc::io, url + ": refused, " + said +
                                "; are the credentials in the environment those of this store?");
    default:
      break;
  }
  if (reply.status >= 300 && reply.status < 400)
    return fail(Errc::io, url + ": the server sends us elsewhere, where we do not go (" + said +
                              "); name the place itself");
  return fail(Errc::io, url + ": " + said);
}

bool is_strong(const std::string& etag) { return etag.size() > 2 && etag.front() == '"'; }

bool encrypted(const HttpReply& reply) {
  const std::string how = reply.header("x-amz-server-side-encryption");
  return how.starts_with("aws:") ||
         !reply.header("x-amz-server-side-encryption-customer-algorithm").empty();
}

ObjectState state_of(const HttpReply& reply, std::uint64_t size) {
  return {size, reply.header("etag"), reply.header("last-modified"), encrypted(reply)};
}

struct ContentRange {
  std::uint64_t first = 0, last = 0, size = 0;
};
/// "bytes 0-99/1234"
std::optional<ContentRange> content_range(const std::string& text) {
  if (!text.starts_with("bytes ")) return {};
  const std::string_view rest = std::string_view(text).substr(6);
  const std::size_t dash = rest.find('-'), slash = rest.find('/');
  if (dash == rest.npos || slash == rest.npos || dash > slash) return {};
  const auto first = number_of(rest.substr(0, dash)),
             last = number_of(rest.substr(dash + 1, slash - dash - 1)),
             size = number_of(rest.substr(slash + 1));
  if (!first || !last || !size || *first > *last || *last >= *size) return {};
  return ContentRange{*first, *last, *size};
}

}  // namespace

std::string md5_of_etag(const std::string& etag) {
  std::string text = etag;
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"')
    text = text.substr(1, text.size() - 2);
  const bool digits = text.size() == 32 && text.find_first_not_of("0123456789abcdef") == text.npos;
  return digits ? text : "";
}

bool is_s3(std::string_view text) { return text.starts_with("s3://"); }

bool is_remote(std::string_view text) {
  return is_s3(text) || text.starts_with("http://") || text.starts_with("https://");
}

S3Settings S3Settings::of_environment() {
  S3Settings s;
  std::string region = variable("AWS_REGION");
  if (region.empty()) region = variable("AWS_DEFAULT_REGION");
  if (!region.empty()) s.region = region;
  s.host = "s3." + s.region + ".amazonaws.com";
  std::string endpoint = variable("AWS_ENDPOINT_URL_S3");
  if (endpoint.empty()) endpoint = variable("AWS_ENDPOINT_URL");
  if (endpoint.empty() && !variable("AWS_S3_ENDPOINT").empty())
    endpoint =
        (says_no(variable("AWS_HTTPS")) ? "http://" : "https://") + variable("AWS_S3_ENDPOINT");
  if (!endpoint.empty()) {
    while (endpoint.ends_with('/')) endpoint.pop_back();
    const std::size_t slashes = endpoint.find("://");
    s.scheme = endpoint.substr(0, std::min(slashes, endpoint.size()));
    s.host = slashes == endpoint.npos ? "" : endpoint.substr(slashes + 3);
    s.bucket_in_host = false;
    const bool plain = s.host.find_first_of("/?#@ ") == s.host.npos;
    if ((s.scheme != "http" && s.scheme != "https") || s.host.empty() || !plain)
      s.wrong = "the endpoint of the S3 store in the environment must be http(s)://HOST[:PORT]";
  }
  if (const std::string hosting = variable("AWS_VIRTUAL_HOSTING"); !hosting.empty())
    s.bucket_in_host = !says_no(hosting);
  AwsKey key{variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY"),
             variable("AWS_SESSION_TOKEN")};
  const std::string unsigned_too = variable("AWS_NO_SIGN_REQUEST");
  if (!unsigned_too.empty() && !says_no(unsigned_too)) return s;
  if (key.id.empty() || key.secret.empty())
    s.wrong = s.wrong.empty()
                  ? "no AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY in the environment; or "
                    "AWS_NO_SIGN_REQUEST=YES where none are needed"
                  : s.wrong;
  const std::string all = key.id + key.secret + key.session + s.region;
  if (std::ranges::any_of(all, [](unsigned char c) { return c <= ' ' || c >= 127; }))
    s.wrong = "AWS_* variables of the environment hold blanks or other than ASCII";
  s.key = std::move(key);
  return s;
}

Patience Patience::of_environment() {
  Patience p;
  if (const auto seconds = number_of(variable("TIND_REMOTE_TIMEOUT")))
    p.answer = std::chrono::seconds(std::clamp<std::uint64_t>(*seconds, 1, 600));
  if (const auto tries = number_of(variable("TIND_REMOTE_TRIES")))
    p.tries = int(std::clamp<std::uint64_t>(*tries, 1, 10));
  return p;
}

Objects Objects::of_environment() {
  return {S3Settings::of_environment(), Patience::of_environment()};
}

struct Objects::Place {
  std::string scheme, host, path;  // path: encoded
  bool s3 = false;
};

struct Objects::Question {
  std::string name;  // of the object, for messages
  Place place;
  std::string method = "GET";
  std::vector<std::pair<std::string, std::string>> query = {}, headers = {};
  std::string_view body = {};
  std::size_t most_bytes = kErrorBytes;
};

Result<Objects::Place> Objects::place_of(const std::string& url) const {
  if (!is_remote(url)) return fail(Errc::invalid_argument, url + " is no place in a store");
  if (std::ranges::any_of(url, [](unsigned char c) { return c < ' ' || c == 127; }))
    return fail(Errc::invalid_argument, "a URL with control characters");
  const std::size_t slashes = url.find("://") + 3;
  const std::size_t slash = std::min(url.find('/', slashes), url.size());
  const std::string first = url.substr(slashes, slash - slashes), rest = url.substr(slash);
  if (first.empty() || first.find('@') != first.npos)
    return fail(Errc::invalid_argument, "a URL without a host, or with a name or password in it");
  if (!is_s3(url)) {
    if (url.starts_with("http://") && !is_loopback(url))
      return fail(Errc::invalid_argument,
                  url + ": only https:// is read by ranges, http:// of this machine alone");
    return Place{url.substr(0, slashes - 3), first, rest.empty() ? "/" : rest, false};
  }
  if (!settings_.wrong.empty()) return fail(Errc::invalid_argument, url + ": " + settings_.wrong);
  const auto ok = [](unsigned char c) {
    return std::isalnum(c) || c == '-' || c == '.' || c == '_';
  };
  if (!std::ranges::all_of(first, ok))
    return fail(Errc::invalid_argument, url + ": that is no name of a bucket");
  const std::string key = uri_encode(rest, true);
  if (settings_.bucket_in_host && first.find('.') == first.npos)
    return Place{settings_.scheme, first + "." + settings_.host, key.empty() ? "/" : key, true};
  return Place{settings_.scheme, settings_.host, "/" + first + key, true};
}

Result<HttpReply> Objects::ask_once(const Question& q) const {
  HttpRequest request{
      .method = q.method,
      .url = q.place.scheme + "://" + q.place.host + q.place.path + query_text(q.query),
      .headers = {},
      .body = q.body,
      .most_bytes = q.most_bytes};
  if (q.place.s3 && settings_.key) {
    const AwsRequest to_sign{.method = q.method,
                             .host = q.place.host,
                             .path = q.place.path,
                             .query = q.query,
                             .headers = q.headers,
                             .body = q.body};
    request.headers =
        signed_headers(to_sign, *settings_.key, settings_.region, std::int64_t(std::time(nullptr)));
  } else {
    for (const auto& [name, value] : q.headers) request.headers.push_back(name + ": " + value);
  }
  auto reply = remote::ask(request, patience_.answer);
  // Says the object's name, as the user has it.
  if (!reply) {
    const std::string& what = reply.error().what;
    const std::size_t colon = what.rfind(": ");
    return fail(reply.error().code, q.name + what.substr(std::min(colon, what.size())));
  }
  return reply;
}

/// `judged(reply)`: Result<void>; io of it may pass, too, and anything else is the answer.
template <class F>
Result<HttpReply> Objects::ask(const Question& q, F&& judged) const {
  Error last;
  for (int k = 0; k < patience_.tries; ++k) {
    if (k > 0) std::this_thread::sleep_for(patience_.pause * (1 << (k - 1)));
    auto reply = ask_once(q);
    if (!reply) {
      last = reply.error();
      continue;
    }
    if (may_pass(reply->status)) {
      last = refusal(q.name, *reply).error();
      continue;
    }
    if (reply->status >= 300) return refusal(q.name, *reply);
    const Result<void> good = judged(*reply);
    if (good) return reply;
    last = good.error();
    if (last.code != Errc::io) return std::unexpected(last);
  }
  return fail(last.code == Errc::out_of_range ? Errc::io : last.code,
              last.what + " (asked " + std::to_string(patience_.tries) + " times)");
}

Result<ObjectState> Objects::head(const std::string& url) const {
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  const Question q{.name = url, .place = std::move(*place), .method = "HEAD"};
  std::uint64_t size = 0;
  const auto reply = ask(q, [&](const HttpReply& r) -> Result<void> {
    const auto length = number_of(r.header("content-length"));
    if (r.status != 200 || !length)
      return fail(Errc::io, url + ": an answer to HEAD that does not say how long it is");
    size = *length;
    return {};
  });
  if (!reply) return std::unexpected(reply.error());
  return state_of(*reply, size);
}

Result<ObjectBytes> Objects::get(const std::string& url, std::size_t most) const {
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  const bool s3 = place->s3;
  const Question q{
      .name = url, .place = std::move(*place), .most_bytes = std::max(most, kErrorBytes)};
  auto reply = ask(q, [&](const HttpReply& r) -> Result<void> {
    if (r.status != 200) return refusal(url, r);
    const auto length = number_of(r.header("content-length"));
    if (!r.header("content-encoding").empty() && r.header("content-encoding") != "identity" && !s3)
      return fail(Errc::unsupported, url + " comes packed, which was not asked for");
    if (!length && !r.header("transfer-encoding").starts_with("chunked"))
      return fail(Errc::io, url + ": an answer that does not say how long it is");
    if (length && *length != r.body.size()) return fail(Errc::io, url + ": the answer is torn");
    if (!s3) return {};
    if (r.header("etag").empty()) return fail(Errc::io, url + ": an answer without an ETag");
    const std::string md5_there = md5_of_etag(r.header("etag"));
    if (!md5_there.empty() && !encrypted(r) &&
        md5_there != hex_md5({reinterpret_cast<const char*>(r.body.data()), r.body.size()}))
      return fail(Errc::io, url + ": other bytes than its MD5 says");
    return {};
  });
  if (!reply) return std::unexpected(reply.error());
  if (reply->body.size() > most) return fail(Errc::out_of_range, url + " is too large");
  return ObjectBytes{state_of(*reply, reply->body.size()), std::move(reply->body)};
}

Result<ObjectBytes> Objects::get_first(const std::string& url, std::size_t most) const {
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  const Question q{.name = url,
                   .place = std::move(*place),
                   .headers = {{"range", "bytes=0-" + std::to_string(most - 1)}},
                   .most_bytes = std::max(most, kErrorBytes)};
  std::uint64_t size = 0;
  auto reply = ask(q, [&](const HttpReply& r) -> Result<void> {
    if (r.status != 206)
      return fail(Errc::io, url + ": the server does not answer requests for ranges (status " +
                                std::to_string(r.status) + ")");
    const auto range = content_range(r.header("content-range"));
    if (!range || range->first != 0 ||
        range->last + 1 != std::min<std::uint64_t>(most, range->size) ||
        r.body.size() != range->last + 1)
      return fail(Errc::io, url + ": other bytes than were asked for");
    size = range->size;
    return {};
  });
  if (!reply) return std::unexpected(reply.error());
  return ObjectBytes{state_of(*reply, size), std::move(reply->body)};
}

Result<Bytes> Objects::get_range(const std::string& url, const ObjectState& version,
                                 std::uint64_t at, std::size_t size) const {
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  Question q{
      .name = url,
      .place = std::move(*place),
      .headers = {{"range", "bytes=" + std::to_string(at) + "-" + std::to_string(at + size - 1)}},
      .most_bytes = std::max(size, kErrorBytes)};
  if (is_strong(version.etag)) q.headers.emplace_back("if-match", version.etag);
  auto reply = ask(q, [&](const HttpReply& r) -> Result<void> {
    const auto range = content_range(r.header("content-range"));
    if (r.status != 206 || !range || range->first != at || range->last != at + size - 1 ||
        r.body.size() != size)
      return fail(Errc::io, url + ": other bytes than were asked for (status " +
                                std::to_string(r.status) + ")");
    if (state_of(r, range->size) == version) return {};
    return fail(Errc::busy, url + " is another than when it was opened: ask again in a moment");
  });
  if (!reply) return std::unexpected(reply.error());
  return std::move(reply->body);
}

Result<void> Objects::check_writable(const std::string& url) const {
  if (is_s3(url)) return {};
  return fail(Errc::unsupported, url + ": only s3:// can be written to");
}

Result<ObjectState> Objects::put(const std::string& url, std::string_view bytes,
                                 const std::string& content_type) const {
  if (auto may = check_writable(url); !may) return std::unexpected(may.error());
  if (bytes.size() > kMostPut)
    return fail(Errc::out_of_range,
                url + ": larger than the 5 GiB that a store takes at once; copy into a prefix");
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  const std::string md5_here = hex_md5(bytes);
  const Question q{.name = url,
                   .place = std::move(*place),
                   .method = "PUT",
                   .headers = {{"content-md5", base64_md5(bytes)}, {"content-type", content_type}},
                   .body = bytes};
  // Whether it is there a look tells, not the answer: that may be lost, or a lie.
  const auto look = [&]() -> Result<ObjectState> {
    const auto there = head(url);
    if (!there) return there;
    const std::string md5_there = there->encrypted ? "" : md5_of_etag(there->etag);
    if (there->size == bytes.size() && (md5_there.empty() || md5_there == md5_here)) return there;
    return fail(Errc::io, url + ": the store has other bytes than were written");
  };
  Error last;
  for (int k = 0; k < patience_.tries; ++k) {
    if (k > 0) std::this_thread::sleep_for(patience_.pause * (1 << (k - 1)));
    const auto reply = ask_once(q);
    if (reply && reply->status >= 300 && !may_pass(reply->status)) return refusal(url, *reply);
    const bool said_so = reply && reply->status < 300 && code_in(reply->body).empty();
    auto there = look();
    if (there && (said_so || (!there->encrypted && !md5_of_etag(there->etag).empty())))
      return there;
    last = !reply     ? reply.error()
           : !said_so ? refusal(url, *reply).error()
           : !there   ? there.error()
                      : Error{Errc::io, url + ": cannot be told whether it was written"};
  }
  return fail(Errc::io, last.what + " (written " + std::to_string(patience_.tries) + " times)");
}

Result<void> Objects::remove(const std::string& url) const {
  if (auto may = check_writable(url); !may) return may;
  auto place = place_of(url);
  if (!place) return std::unexpected(place.error());
  const Question q{.name = url, .place = std::move(*place), .method = "DELETE"};
  const auto reply = ask(q, [](const HttpReply&) -> Result<void> { return {}; });
  if (!reply && reply.error().code != Errc::not_found) return std::unexpected(reply.error());
  return {};
}

namespace {

/// Of one page; nothing where it is not whole.
std::optional<std::vector<ListedObject>> objects_in(std::string_view page,
                                                    const std::string& prefix) {
  std::vector<ListedObject> found;
  if (page.find("</ListBucketResult>") == page.npos) return {};
  for (std::size_t at = 0;;) {
    const auto one = between(page, "Contents", at);
    if (!one) return found;
    at = std::size_t(one->data() - page.data()) + one->size();
    const auto key = between(*one, "Key"), size = between(*one, "Size"),
               etag = between(*one, "ETag");
    const auto bytes = size ? number_of(*size) : std::nullopt;
    if (!key || !bytes) return {};
    const std::string name = unescaped(*key);
    if (!name.starts_with(prefix)) return {};
    found.push_back(
        {name.substr(prefix.size()), *bytes, etag ? md5_of_etag(unescaped(*etag)) : std::string()});
  }
}

}  // namespace

Result<std::vector<ListedObject>> Objects::list(const std::string& url, std::size_t most) const {
  if (auto may = check_writable(url); !may) return std::unexpected(may.error());
  const std::size_t slash = std::min(url.find('/', 5), url.size());
  const std::string prefix = url.substr(std::min(slash + 1, url.size()));
  auto place = place_of(url.substr(0, slash) + "/");
  if (!place) return std::unexpected(place.error());
  if (place->path.size() > 1 && place->path.ends_with('/')) place->path.pop_back();
  std::vector<ListedObject> all;
  std::string next;
  for (;;) {
    Question q{.name = url,
               .place = *place,
               .query = {{"list-type", "2"}, {"prefix", prefix}},
               .most_bytes = kListBytes};
    if (!next.empty()) q.query.emplace_back("continuation-token", next);
    std::vector<ListedObject> page;
    const auto reply = ask(q, [&](const HttpReply& r) -> Result<void> {
      const auto found = r.status == 200 ? objects_in(text_of(r.body), prefix) : std::nullopt;
      if (!found) return fail(Errc::io, url + ": no whole list of the store's objects");
      page = *found;
      return {};
    });
    if (!reply) return std::unexpected(reply.error());
    std::ranges::move(page, std::back_inserter(all));
    if (all.size() > most) return fail(Errc::out_of_range, url + " has too many objects");
    const std::string text = text_of(reply->body);
    if (between(text, "IsTruncated") != "true") break;
    const std::string before =
        std::exchange(next, unescaped(between(text, "NextContinuationToken").value_or("")));
    if (next.empty() || next == before)
      return fail(Errc::io, url + ": the store's list does not go on");
  }
  std::ranges::sort(all, {}, &ListedObject::key);
  return all;
}

}  // namespace tind::remote
