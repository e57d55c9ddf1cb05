#pragma once
// An S3 store and web server of this process's own, which breaks on command. It checks what a
// client says of its bytes (Content-MD5, x-amz-content-sha256) and If-Match; signatures real stores
// check (scripts/try_object_stores).

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace tind {

class S3Stub {
 public:
  enum class Fault {
    e500,
    e503,
    e403,
    reset,        // the connection, before an answer
    hang,         // no answer until the client goes
    cut,          // half of the body that was announced
    short_body,   // half of the body, and so announced
    other_body,   // one byte is another
    no_range,     // the whole object, whatever was asked for
    wrong_range,  // other bytes than were asked for, and so announced
    error_200,    // "200 OK", and in the body that there was an error
    lost,         // done, and no answer
    lie,          // "200 OK", and nothing was done
    half_done,    // "200 OK", and half of the bytes were stored
    redirect,
    no_length,  // neither Content-Length nor chunks: the end is the end of the connection, halfway
  };

  S3Stub();
  ~S3Stub();
  S3Stub(const S3Stub&) = delete;
  S3Stub& operator=(const S3Stub&) = delete;

  /// "http://127.0.0.1:PORT"
  std::string address() const { return "http://127.0.0.1:" + std::to_string(port_); }

  /// The next `times` requests of this kind ("GET", "HEAD", "PUT", "DELETE", "LIST") for keys that
  /// hold `part` break so.
  void fail_next(const std::string& kind, Fault fault, int times, const std::string& part = "");
  void mend();

  /// By "bucket/key".
  std::map<std::string, std::string> objects() const;
  void put(const std::string& path, std::string bytes);
  void erase(const std::string& path);
  /// Requests of this kind until now.
  int count(const std::string& kind) const;
  /// Requests whose bytes were not those that they said.
  int wrong_digests() const;

 private:
  struct Plan {
    std::string kind, part;
    Fault fault;
    int left = 0;
  };
  struct Request;

  int listener_ = -1, port_ = 0;
  mutable std::mutex mutex_;
  std::map<std::string, std::string> objects_;
  std::vector<Plan> plans_;
  std::map<std::string, int> counts_;
  int wrong_digests_ = 0;
  bool stopping_ = false;
  std::vector<int> open_;
  std::vector<std::thread> threads_;
  std::thread acceptor_;

  void accept_all();
  void serve(int socket);
  bool answer(int socket, const Request&);
  bool plan_for(const Request&, Fault&);
  std::string list(const Request&) const;
};

/// While it lives, the environment names the stub as the S3 store.
class S3Environment {
 public:
  explicit S3Environment(const S3Stub&, int seconds = 2, int tries = 3);
  ~S3Environment();
  S3Environment(const S3Environment&) = delete;
  S3Environment& operator=(const S3Environment&) = delete;
};

}  // namespace tind
