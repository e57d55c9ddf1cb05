#include "terrain/raster/gdal/crs/proj_operation.h"

#include <proj.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "terrain/raster/gdal/crs/proj_files.h"

namespace tind::gdal {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Operation::Operation(std::string grids) : context(proj_context_create()), folder(std::move(grids)) {
  proj_context_set_enable_network(context, 0);
  proj_log_level(context, PJ_LOG_NONE);
  if (folder.empty()) return;
  allow_folder(context, folder);
  std::vector<std::string> all{folder};
  const char* const own = proj_info().searchpath;
  for (std::string_view rest = own ? own : ""; !rest.empty();) {
    all.emplace_back(rest.substr(0, rest.find(':')));
    rest.remove_prefix(std::min(all.back().size() + 1, rest.size()));
  }
  std::vector<const char*> names;
  names.reserve(all.size());
  for (const std::string& one : all) names.push_back(one.c_str());
  proj_context_set_search_paths(context, int(names.size()), names.data());
}

Operation::~Operation() {
  proj_destroy(pj);
  proj_context_destroy(context);
}

std::unique_ptr<Operation> Operations::take() const {
  const std::lock_guard lock(mutex_);
  if (!idle_.empty()) {
    auto one = std::move(idle_.back());
    idle_.pop_back();
    return one;
  }
  auto one = std::make_unique<Operation>(original_->folder);
  one->pj = proj_clone(one->context, original_->pj);
  return one;
}

void Operations::give(std::unique_ptr<Operation> one) const {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(one));
}

void Operations::run(bool forward, std::span<Vec2> points, std::span<double> heights) const {
  if (points.empty()) return;
  auto one = take();
  proj_errno_reset(one->pj);
  proj_trans_generic(one->pj, forward ? PJ_FWD : PJ_INV, &points[0].x, sizeof(Vec2), points.size(),
                     &points[0].y, sizeof(Vec2), points.size(), heights.data(), sizeof(double),
                     heights.size(), nullptr, 0, 0);
  give(std::move(one));
  for (Vec2& p : points)
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) p = {kNaN, kNaN};
  for (double& z : heights)
    if (!std::isfinite(z)) z = kNaN;
}

}  // namespace tind::gdal
