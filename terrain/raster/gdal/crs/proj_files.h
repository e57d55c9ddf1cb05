#pragma once
// Which files PROJ may open. A CRS can name grids by their paths (nadgrids=/some/file), and GDAL
// has PROJ open them as soon as it reads the CRS of a raster, long before anybody could look at it.
// So every context of PROJ in this program opens files through us: those of PROJ's own folders, and
// what an operator names.

#include <string>

struct pj_ctx;

namespace tind::gdal {

/// This context may open the files of one more folder. `folder` outlives the context.
void allow_folder(pj_ctx* context, const std::string& folder);

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
