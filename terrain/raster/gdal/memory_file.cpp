#include "terrain/raster/gdal/memory_file.h"

#include <cpl_vsi.h>

#include <atomic>

namespace tind::gdal {
namespace {

std::string bytes_of(const std::string& name) {
  vsi_l_offset size = 0;
  const GByte* const data = VSIGetMemFileBuffer(name.c_str(), &size, FALSE);
  return data ? std::string(reinterpret_cast<const char*>(data), std::size_t(size)) : std::string();
}

}  // namespace

MemoryFile::MemoryFile(const std::string& extension) {
  static std::atomic<unsigned> count{0};
  stem_ = "/vsimem/tind-output-" + std::to_string(++count);
  name_ = stem_ + extension;
}

MemoryFile::~MemoryFile() {
  VSIUnlink(name_.c_str());
  VSIUnlink((stem_ + ".prj").c_str());
}

std::string MemoryFile::bytes() const { return bytes_of(name_); }

std::string MemoryFile::bytes_beside(const std::string& extension) const {
  return bytes_of(stem_ + extension);
}

}  // namespace tind::gdal
