#pragma once
// The bodies of POSTs: JSON from anybody. Whatever is wrong is said with the name of the parameter,
// in one way for all of them.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/problem.h"

namespace tind::api {

using Json = nlohmann::json;

/// What is wrong with a request. Of very many only the first are kept.
class Problems {
 public:
  void add(std::string parameter, std::string detail) {
    if (list_.size() < kMost) list_.push_back({std::move(parameter), std::move(detail)});
  }
  bool empty() const { return list_.empty(); }
  const std::vector<http::ParameterProblem>& list() const { return list_; }

 private:
  static constexpr std::size_t kMost = 20;
  std::vector<http::ParameterProblem> list_;
};

/// An object, empty (and a problem) where the body is none, or has more values than whoever asks
/// rightly can send: they are counted before any is built, because each takes up to 100 bytes.
Json parse_body(std::string_view body, std::size_t most_values, Problems&);

/// False, and a problem, where some object of a body has a name twice: readers differ on which one
/// counts. `built`: json::values_of() the body, which has fewer values than its text then; so only
/// a body that is wrong is read again.
bool has_names_once(std::string_view body, std::size_t built, Problems&);

/// Reads the members of one object, and keeps what is wrong with them under their names:
/// "camera.lon", "trajectory[3].lat".
class Members {
 public:
  /// What is no object is a problem, and then has no members. `path`: "camera", or empty.
  Members(const Json&, std::string path, Problems&);

  enum class Need { must, may };
  /// `value` stays as it is where there is none, or a wrong one.
  void number(const char* name, double low, double high, double& value, Need need = Need::may);
  /// Null where it is not there.
  const Json* member(const char* name, Need need = Need::may);
  /// To be called last: other members are problems.
  void nothing_else();

  std::string name_of(const char* member) const;

 private:
  const Json& object_;
  const std::string path_;
  Problems& problems_;
  std::vector<std::string> known_;  // names may come and go
};

}  // namespace tind::api
