#include "server/http/message/media_choice.h"

#include "server/http/message/accept_list.h"

namespace tind::http {
namespace {

/// How closely a media range names a type: 0: not at all, 1: */*, 2: text/*, 3: text/html.
int closeness(std::string_view range, std::string_view type) {
  if (same_word(range, type)) return 3;
  if (range == "*/*" || range == "*") return 1;
  const std::size_t slash = range.find('/');
  return slash != range.npos && range.substr(slash) == "/*" &&
                 same_word(range.substr(0, slash), type.substr(0, type.find('/')))
             ? 2
             : 0;
}

struct Wish {
  int closeness = 0, weight = 0;
};

}  // namespace

std::optional<std::size_t> preferred_type(const Fields& fields,
                                          std::span<const std::string_view> offered) {
  bool said = false;
  std::optional<std::size_t> best;
  int most = 0;
  for (std::size_t k = 0; k < offered.size(); ++k) {
    Wish wish;
    fields.each("accept", [&](std::string_view list) {
      said = true;
      while (!list.empty()) {
        std::string_view parameters = take_until(list, ',');
        const std::string_view range = take_until(parameters, ';');
        const int close = closeness(range, offered[k]);
        if (close > wish.closeness) wish = {close, weight_of(parameters)};
      }
    });
    if (wish.weight > most) best = k, most = wish.weight;
  }
  if (!said) return 0;
  return best;
}

}  // namespace tind::http
