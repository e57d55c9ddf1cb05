#pragma once
// What a route does for its clients, as a value: the router finds it, its handler reads the query
// by its rows, keys are held against its scope, and the OpenAPI document is written from it. So
// what is documented is what is done.
//
// Schemas and examples are JSON texts (JSON Schema 2020-12).

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/query_numbers.h"
#include "server/http/message/request.h"

namespace tind::http {

/// What a key must have to ask for it.
enum class Scope : std::uint8_t {
  open,   // nothing: health, documentation, the viewer's files
  tiles,  // tiles in all their formats
  read,   // questions that are answered at once
  jobs,   // work that is done for a client, and its results
  admin   // what is for the operator
};
std::string_view name(Scope);

/// A {name} of the pattern.
struct PathParameter {
  std::string name, about;
  std::string schema = R"({"type": "string"})";
  std::string example = {};  // a JSON value
};

/// A body in one of its forms. What it weighs at most and which types there are, BodyRules say.
struct Content {
  std::string type;         // "application/json"
  std::string schema = {};  // empty: bytes
  std::string example = {};
};

struct Response {
  int status = 200;
  std::string about;
  std::vector<Content> content = {};
};

struct Operation {
  std::string id = {};       // "getElevation": of one operation alone
  std::string tag = {};      // the chapter of the document
  std::string summary = {};  // a line
  std::string about = {};
  Scope scope = Scope::read;
  /// Shows nothing of a dataset that Request::sees() denies. A key of some datasets may ask what is
  /// not so only where the path names one of its own.
  bool heeds_access = false;
  std::vector<QueryNumber> numbers = {};  // of the query
  std::vector<QueryWord> words = {};
  /// Parameters that are none of these count for nothing; else they are errors.
  bool ignores_others = false;
  std::vector<PathParameter> path = {};  // other than those that mean the same everywhere
  std::vector<Content> body = {};
  /// The answers beside those that every operation has (400 to 503).
  std::vector<Response> responses = {};
  bool is_hidden = false;  // for our own page, not in the document
};

/// The query by the rows of the operation that the router has found.
/// REQUIRES: a route with an operation.
QueryNumbers read_query(const Request&);

}  // namespace tind::http
