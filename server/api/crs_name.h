#pragma once
// Reference systems as clients name them: codes, OGC's URIs, URNs and short forms.

#include <optional>
#include <string>
#include <string_view>

namespace tind::api {

/// CRS84 (longitude, latitude), or "EPSG:2056": of these words, "OGC:CRS84", both in brackets, and
/// OGC's URIs and URNs for them. Nothing for anything else: no name is ever a file's.
std::optional<std::string> crs_named(std::string_view);

/// "http://www.opengis.net/def/crs/EPSG/0/2056". REQUIRES: of crs_named().
std::string crs_uri(const std::string& name);

/// For http::QueryWord.
bool is_crs_name(std::string_view);
inline constexpr std::string_view kCrsForm = "EPSG:CODE, or OGC's URI for one of them";

}  // namespace tind::api
