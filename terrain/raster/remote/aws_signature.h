#pragma once
// Signature Version 4 of Amazon's, as every S3 store understands it
// (docs.aws.amazon.com/AmazonS3/latest/API/sig-v4-header-based-auth.html).

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tind::remote {

struct AwsKey {
  std::string id, secret, session;  // session: of keys that expire; may be empty
};

/// What is signed. Names of headers in small letters; host and the x-amz- ones are added.
struct AwsRequest {
  std::string method, host;  // with the port, where it is not the scheme's own
  std::string path;          // encoded: uri_encode()
  std::vector<std::pair<std::string, std::string>> query;    // not encoded
  std::vector<std::pair<std::string, std::string>> headers;  // to be sent, and signed
  std::string_view body;
};

/// All headers to send, "name: value", the signature among them. `seconds`: since 1970.
std::vector<std::string> signed_headers(const AwsRequest&, const AwsKey&, const std::string& region,
                                        std::int64_t seconds);

/// Letters, digits and -._~ stay, and '/' where it separates.
std::string uri_encode(std::string_view text, bool keep_slashes);
/// "?a=b&c=d", encoded, in the order in which it is signed; empty without any.
std::string query_text(const std::vector<std::pair<std::string, std::string>>&);

}  // namespace tind::remote
