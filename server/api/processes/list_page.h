#pragma once
// Lists in pages, as OGC API - Processes has them: `limit` entries, and a link to the next.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "server/api/ogc/document.h"
#include "server/http/message/query_numbers.h"

namespace tind::api {

inline constexpr std::size_t kLongestPage = 1000;

/// The parameters `limit` and `offset`, which list_page() reads as the first two of an operation.
std::vector<http::QueryNumber> page_numbers();

struct ListPage {
  std::size_t offset = 0, limit = kLongestPage;

  /// Whether the entry of that number is on it.
  bool has(std::size_t number) const { return number >= offset && number - offset < limit; }
};

ListPage list_page(const http::QueryNumbers&);

/// An address with one parameter said anew, or left out where the value is empty.
std::string with_parameter(const std::string& url, const std::string& name,
                           const std::string& value);

/// Links to the page itself, and to the next and the one before where there are any of `entries`.
nlohmann::ordered_json page_links(const ogc::Asked&, const ListPage&, std::size_t entries);

}  // namespace tind::api
