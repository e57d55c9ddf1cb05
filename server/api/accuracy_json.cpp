#include "server/api/accuracy_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace tind::api {

nlohmann::ordered_json accuracy_json(const VerticalAccuracy& accuracy) {
  return {{"kind", name_of(accuracy.kind)}, {"m", accuracy.metres}};
}

nlohmann::ordered_json accuracies_json(const std::vector<proto::StatedAccuracy>& stated) {
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (const proto::StatedAccuracy& one : stated) {
    nlohmann::ordered_json json = {{"kind", one.kind}, {"m", one.metres}};
    if (one.layer.empty()) return json;
    all[one.layer] = std::move(json);
  }
  return all;
}

std::string accuracy_text(const VerticalAccuracy& accuracy) {
  const std::string metres = fmt::format("{:g}", accuracy.metres);
  return accuracy.kind == AccuracyKind::unspecified ? metres
                                                    : name_of(accuracy.kind) + "=" + metres;
}

}  // namespace tind::api
