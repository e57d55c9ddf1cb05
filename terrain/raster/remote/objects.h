#pragma once
// Files on other machines, by name: objects of S3 stores (s3://bucket/key) and what plain web
// servers have (http://, https://). The one way of terrain/ to them, and it takes nobody's word:
// an answer counts when its status, its length, its range and the version of the object are those
// that were asked for; what was written counts when a fresh look finds its size and its MD5. What
// can pass (no answer, a torn one, 5xx, 429) is asked again, a bounded number of times. Nothing is
// followed to another place.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/remote/aws_signature.h"
#include "terrain/raster/remote/http_client.h"

namespace tind::remote {

bool is_s3(std::string_view text);
/// s3://, http:// or https://
bool is_remote(std::string_view text);

/// How to reach an S3 store: by the environment, never by what a client says.
struct S3Settings {
  std::string scheme = "https", host = "s3.amazonaws.com";
  bool bucket_in_host = true;
  std::string region = "us-east-1";
  std::optional<AwsKey> key;  // none: nothing is signed
  std::string wrong;          // what is wrong with the environment; empty: nothing

  /// AWS_ENDPOINT_URL_S3, AWS_ENDPOINT_URL or AWS_S3_ENDPOINT with AWS_HTTPS;
  /// AWS_VIRTUAL_HOSTING; AWS_REGION or AWS_DEFAULT_REGION; AWS_ACCESS_KEY_ID,
  /// AWS_SECRET_ACCESS_KEY, AWS_SESSION_TOKEN; AWS_NO_SIGN_REQUEST.
  static S3Settings of_environment();
};

struct Patience {
  std::chrono::milliseconds answer{10'000};  // one; large ones may take longer (http_client.h)
  std::chrono::milliseconds pause{200};      // before the second try; doubled for each further one
  int tries = 4;

  /// TIND_REMOTE_TIMEOUT (seconds), TIND_REMOTE_TRIES.
  static Patience of_environment();
};

/// One version of an object.
struct ObjectState {
  std::uint64_t size = 0;
  std::string etag;        // as it was given, with its quotes; may be empty at a web server
  std::string modified;    // Last-Modified
  bool encrypted = false;  // with keys of the store's: its ETag is no MD5, though it may look so
  friend bool operator==(const ObjectState&, const ObjectState&) = default;
};

struct ObjectBytes {
  ObjectState state;
  std::vector<std::uint8_t> bytes;
};

struct ListedObject {
  std::string key;  // behind the prefix that was asked for
  std::uint64_t size = 0;
  std::string etag;  // without its quotes
};

/// Errors: not_found (404, 410); busy (it is another version than was asked for); io for all else
/// that a server does or does not say; unsupported. They name the object, never a secret.
class Objects {
 public:
  Objects(S3Settings settings, Patience patience)
      : settings_(std::move(settings)), patience_(patience) {}
  static Objects of_environment();

  Result<ObjectState> head(const std::string& url) const;
  /// All of it, `most` bytes at most (out_of_range). Of S3 stores held against its MD5, where its
  /// ETag is one.
  Result<ObjectBytes> get(const std::string& url, std::size_t most) const;
  /// The first bytes, `most` at most, and how many there are in all. bad_data: it is empty.
  Result<ObjectBytes> get_first(const std::string& url, std::size_t most) const;
  /// These bytes of this version. REQUIRES: they lie in it, size > 0.
  Result<std::vector<std::uint8_t>> get_range(const std::string& url, const ObjectState& version,
                                              std::uint64_t at, std::size_t size) const;

  /// Below, S3 only (else unsupported). One PUT, looked at afterwards.
  Result<ObjectState> put(const std::string& url, std::string_view bytes,
                          const std::string& content_type) const;
  /// What is not there is no failure.
  Result<void> remove(const std::string& url) const;
  /// All whose keys begin with that of the URL, sorted. `most`: fails (out_of_range) beyond.
  Result<std::vector<ListedObject>> list(const std::string& url, std::size_t most = SIZE_MAX) const;

 private:
  struct Question;
  struct Place;
  using Judge = Result<void> (*)(const Question&, const HttpReply&);

  S3Settings settings_;
  Patience patience_;

  Result<Place> place_of(const std::string& url) const;
  Result<HttpReply> ask_once(const Question&) const;
  template <class F>
  Result<HttpReply> ask(const Question&, F&& judged) const;
  Result<void> check_writable(const std::string& url) const;
};

/// The MD5 that an ETag of an S3 store is, 32 digits; empty where it is none.
std::string md5_of_etag(const std::string& etag);

}  // namespace tind::remote
