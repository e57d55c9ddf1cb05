#include "server/http/message/representation.h"

#include "server/http/message/byte_range.h"
#include "server/http/message/problem.h"
#include "terrain/base/deflate.h"
#include "terrain/base/hash.h"

namespace tind::http {
namespace {

constexpr std::size_t kWorthCompressing = 256;  // below, headers outweigh what is saved

/// Empty where compressing does not save at least a tenth.
std::string gzipped(std::string_view bytes) {
  if (bytes.size() < kWorthCompressing) return {};
  return deflate<std::string>(bytes, Wrapping::gzip, 6, bytes.size() - bytes.size() / 10);
}

}  // namespace

std::shared_ptr<const Representation> Representation::make(std::string_view body,
                                                           const Options& options) {
  auto made = std::make_shared<Representation>();
  made->ranges_ = options.ranges && !options.compress;
  made->content_type_ = options.content_type;
  made->cache_control_ = options.cache_control;
  made->vary_ = options.vary;
  const std::string hash = hash128(body).text();
  made->etag_ = "\"" + hash + "\"";
  made->gzip_etag_ = "\"" + hash + "-gz\"";
  const auto payload = [&](int status, std::string_view etag, bool gzip, std::string_view bytes) {
    std::vector<Header> headers = made->headers(etag);
    headers.insert(headers.end(), options.fields.begin(), options.fields.end());
    if (gzip && status == 200) headers.push_back({"Content-Encoding", "gzip"});
    auto result = make_payload(status, options.content_type, headers, bytes);
    result->shared = true;
    made->memory_ += sizeof(Payload) + result->bytes.capacity();
    return result;
  };
  made->plain_ = payload(200, made->etag_, false, body);
  made->plain_304_ = payload(304, made->etag_, false, {});
  const std::string compressed = options.compress ? gzipped(body) : std::string();
  if (!compressed.empty()) {
    made->gzip_ = payload(200, made->gzip_etag_, true, compressed);
    made->gzip_304_ = payload(304, made->gzip_etag_, true, {});
  }
  made->memory_ += sizeof(Representation) + 128;
  return made;
}

std::vector<Header> Representation::headers(std::string_view etag) const {
  std::vector<Header> headers = {{"ETag", etag}, {"Cache-Control", cache_control_}};
  if (!vary_.empty()) headers.push_back({"Vary", vary_});
  if (ranges_) {
    headers.push_back({"Accept-Ranges", "bytes"});
    headers.push_back({"Access-Control-Expose-Headers", "Accept-Ranges, Content-Range, ETag"});
  }
  return headers;
}

std::shared_ptr<const Representation> Representation::beginning(std::size_t bytes) const {
  return make(body().substr(0, bytes), {.content_type = content_type_,
                                        .cache_control = cache_control_,
                                        .vary = vary_,
                                        .compress = false,
                                        .ranges = ranges_});
}

Reply changed(std::string_view target) {
  return problem_reply({.status = 412,
                        .detail = "This is not what If-Match names; it is another by now.",
                        .instance = target});
}

Reply Representation::part(std::string_view range) const {
  const std::string size = std::to_string(body().size());
  const AskedRange asked = asked_range(range, body().size());
  if (asked.kind == AskedRange::Kind::whole) return {200, plain_, false};
  if (asked.kind == AskedRange::Kind::beyond) {
    const std::string there = "bytes */" + size;
    return problem_reply({.status = 416,
                          .detail = "The resource has " + size + " bytes.",
                          .headers = {{"Content-Range", there}}});
  }
  const std::string where = "bytes " + std::to_string(asked.first) + "-" +
                            std::to_string(asked.first + asked.count - 1) + "/" + size;
  std::vector<Header> all = headers(etag_);
  all.push_back({"Content-Range", where});
  return make_reply(206, content_type_, body().substr(asked.first, asked.count), all);
}

Reply Representation::reply(const Conditions& client) const {
  const bool gzip = gzip_ && client.gzip;
  if (client.excludes(etag_, gzip_etag_)) return changed();
  if (!client.none_match.empty() && lists_etag(client.none_match, gzip ? gzip_etag_ : etag_))
    return {304, gzip ? gzip_304_ : plain_304_, false};
  if (ranges_ && !client.range.empty() && (client.if_range.empty() || client.if_range == etag_))
    return part(client.range);
  return {200, gzip ? gzip_ : plain_, false};
}

}  // namespace tind::http
