#pragma once
// Which files PROJ may open. A CRS can name grids by their paths (nadgrids=/some/file), and GDAL
// has PROJ open them as soon as it reads the CRS of a raster, long before anybody could look at it.
// So every context of PROJ in this program opens files through us: those of PROJ's own folders, and
// what an operator names.

#include <optional>
#include <string>

#include "terrain/base/errno_text.h"
#include "terrain/base/result.h"

struct pj_ctx;

namespace tind::gdal {

/// This context may open the files of one more folder. `folder` outlives the context.
void allow_folder(pj_ctx* context, const std::string& folder);

/// What this thread's PROJ could not look at or read since the last call, which PROJ takes for not
/// there, and then takes another grid, or none: errno and the file. Nothing: there was no such
/// file.
struct UnreadGrid {
  int code = 0;
  std::string file;
};
std::optional<UnreadGrid> take_unread_grid();
/// What `make` makes by PROJ, or io where PROJ could not read something on the way.
template <class Make>
auto if_all_is_read(const Make& make) -> decltype(make()) {
  (void)take_unread_grid();
  auto made = make();
  if (const auto unread = take_unread_grid())
    return fail(Errc::io, "cannot read " + unread->file + ": " + errno_text(unread->code));
  return made;
}

/// While it lives, this thread reads what an operator wrote: a path that PROJ is asked for then may
/// be opened from then on.
class OperatorNamesGrids {
 public:
  OperatorNamesGrids();
  ~OperatorNamesGrids();
  OperatorNamesGrids(const OperatorNamesGrids&) = delete;
  OperatorNamesGrids& operator=(const OperatorNamesGrids&) = delete;
};

}  // namespace tind::gdal
