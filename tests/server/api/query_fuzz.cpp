// Any bytes as the query of EDR and of coverages, as extensions, addresses and key tables' words:
// read within the stated limits, or refused with the name of what is wrong.

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/extensions.h"
#include "server/api/ogc/asked_crs.h"
#include "server/api/ogc/coverage_query.h"
#include "server/api/ogc/edr_query.h"
#include "server/api/tiles/tile_address.h"
#include "server/services/access/keys.h"
#include "server/services/datasets/key_table.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using namespace tind;
using test::require;

template <class Query>
void named(const std::expected<Query, std::vector<http::ParameterProblem>>& read) {
  if (read) return;
  require(!read.error().empty(), "refused, and nobody knows why");
  for (const auto& problem : read.error())
    require(!problem.detail.empty(), "a problem without a text");
}

void ogc(std::string_view query) {
  const http::Fields fields;
  for (const auto& [shape, name] : EnumNames<api::ogc::EdrShape>::kAll) {
    const auto read = api::ogc::read_edr_query(shape, query, fields);
    named(read);
    if (read)
      require(read->along >= 0 && read->across >= 0 && read->width_m >= 0, "a size below 0");
  }
  const auto coverage = api::ogc::read_coverage_query(query, fields);
  named(coverage);
  if (coverage) require(coverage->width >= 0 && coverage->height >= 0, "a size below 0");
  if (const auto four = api::ogc::four_numbers(query))
    for (const double v : *four) require(std::isfinite(v), "a number that is none");
}

/// As a query, and as an Accept field.
void extensions(std::string_view text) {
  constexpr std::string_view kName = "accept";
  if (text.size() > 8000) return;  // heads are shorter
  const std::string line = std::string(kName).append(text);
  const auto ends = std::uint16_t(kName.size());
  const std::vector<http::Fields::Entry> entries = {
      {{0, ends}, {ends, std::uint16_t(line.size())}}};
  (void)api::asked_extensions(http::Fields(line.data(), entries), text);
}

void addresses(std::string_view text) {
  const auto slash = text.find('/'), second = text.find('/', slash + 1);
  if (second == text.npos) return;
  const auto id = api::tile_address(
      text.substr(0, slash), text.substr(slash + 1, second - slash - 1), text.substr(second + 1));
  if (id) require(id->x < (2u << id->level) && id->y < (1u << id->level), "outside the pyramid");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  ogc(text);
  addresses(text);
  extensions(text);
  (void)services::scopes_of(text);
  (void)services::time_of(text);
  (void)services::hash_of_hex(text);
  (void)services::origins_of(text);
  return 0;
}
