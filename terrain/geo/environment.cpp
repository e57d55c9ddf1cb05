#include "terrain/geo/environment.h"

#include "terrain/base/file_there.h"

namespace tind {

Result<std::shared_ptr<const Geoid>> Environment::egm96() const {
  constexpr char kName[] = "egm96-15";
  const std::lock_guard lock(mutex_);
  if (egm96_) return egm96_;
  const std::string folder = data_dir_ + "/geoids";
  const auto there = is_there(folder + "/" + kName + ".pgm");
  if (!there) return std::unexpected(there.error());
  if (!*there)
    return fail(
        Errc::not_found,
        "the EGM96 geoid grid egm96-15.pgm is missing (looked in " + folder +
            "); make it with scripts/make_geoid, or name the folder that has geoids/ in TIND_DATA");
  auto loaded = Geoid::load(folder, kName);
  if (loaded) egm96_ = *loaded;
  return loaded;
}

}  // namespace tind
