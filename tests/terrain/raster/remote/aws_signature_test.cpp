// Held against the examples of Amazon's documentation of Signature Version 4.

#include "terrain/raster/remote/aws_signature.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tind::remote {
namespace {

using testing::EndsWith;

const AwsKey kKey{"AKIAIOSFODNN7EXAMPLE", "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY", ""};
constexpr std::int64_t kTime = 1369353600;  // 2013-05-24 00:00 UTC
const std::string kHost = "examplebucket.s3.amazonaws.com";

std::string authorization(const AwsRequest& request) {
  return signed_headers(request, kKey, "us-east-1", kTime).back();
}

TEST(AwsSignature, GetWithRange) {
  EXPECT_THAT(authorization({.method = "GET",
                             .host = kHost,
                             .path = "/test.txt",
                             .query = {},
                             .headers = {{"range", "bytes=0-9"}},
                             .body = {}}),
              EndsWith("f0e8bdb87c964420e857bd35b5d6ed310bd44f0170aba48dd91039c6036bdb41"));
}

TEST(AwsSignature, Put) {
  EXPECT_THAT(authorization({.method = "PUT",
                             .host = kHost,
                             .path = uri_encode("/test$file.text", true),
                             .query = {},
                             .headers = {{"date", "Fri, 24 May 2013 00:00:00 GMT"},
                                         {"x-amz-storage-class", "REDUCED_REDUNDANCY"}},
                             .body = "Welcome to Amazon S3."}),
              EndsWith("98ad721746da40c64f1a55b78f14c238d841ea1380cd77a1b5971af0ece108bd"));
}

TEST(AwsSignature, ListWithQuery) {
  EXPECT_THAT(authorization({.method = "GET",
                             .host = kHost,
                             .path = "/",
                             .query = {{"prefix", "J"}, {"max-keys", "2"}},
                             .headers = {},
                             .body = {}}),
              EndsWith("34b48302e7b5fa45bde8084f4b7868a86f0a534bc59db6670ed5711ef69dc6f7"));
}

TEST(AwsSignature, EncodesWhatIsNotPlain) {
  EXPECT_EQ(uri_encode("/a b/ü~+", true), "/a%20b/%C3%BC~%2B");
  EXPECT_EQ(uri_encode("a/b", false), "a%2Fb");
  EXPECT_EQ(query_text({{"prefix", "x/y"}, {"list-type", "2"}}), "?list-type=2&prefix=x%2Fy");
}

}  // namespace
}  // namespace tind::remote
