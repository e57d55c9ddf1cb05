#include "server/api/accuracy_json.h"

#include <nlohmann/json.hpp>

namespace tind::api {

nlohmann::ordered_json accuracy_json(const VerticalAccuracy& accuracy) {
  return {{"kind", name_of(accuracy.kind)}, {"m", accuracy.metres}};
}

}  // namespace tind::api
