#pragma once
// Which of several forms of a resource a client would rather have (RFC 9110, 12.5.1).

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "server/http/message/request_parser.h"

namespace tind::http {

/// The index of the one with the greatest weight in Accept, the first of several with the same;
/// a media range with more words decides before one with fewer ("text/html" before "text/*").
/// Parameters other than q count for nothing. Nothing where none is wanted; without the field: 0.
/// `offered`: media types without parameters, in small letters. REQUIRES: at least one.
std::optional<std::size_t> preferred_type(const Fields&, std::span<const std::string_view> offered);

}  // namespace tind::http
