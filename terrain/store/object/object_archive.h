#pragma once
// An archive that is written as a whole, as one object.

#include <functional>
#include <memory>
#include <string>

#include "terrain/base/result.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/archive_writer.h"

namespace tind {

/// Opens the writer of an archive that is a file.
using WriteArchive = std::function<Result<std::unique_ptr<ArchiveWriter>>(const std::string& file)>;

/// The file is made in a folder of its own below the system's for temporary ones (TMPDIR), and
/// becomes an object with one PUT, looked at afterwards: nobody sees a part of it. `name`: how the
/// file is called.
Result<std::unique_ptr<ArchiveWriter>> write_object_archive(const std::string& url,
                                                            const std::string& name,
                                                            const remote::Objects&,
                                                            const WriteArchive&);

}  // namespace tind
