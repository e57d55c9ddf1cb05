#include "terrain/store/open/open_store.h"

#include "terrain/store/folder/folder_writer.h"

namespace tind {

Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location) {
  return lock_folder(location);
}

}  // namespace tind
