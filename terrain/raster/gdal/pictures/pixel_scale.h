#pragma once
// What the pixels of images count up to.

#include <gdal.h>

namespace tind::gdal {

/// What white is in pixels of this type; of types other than 8 and 16 bits 1.
inline double full_scale(GDALDataType type) {
  switch (type) {
    case GDT_Byte:
      return 255;
    case GDT_UInt16:
      return 65535;
    case GDT_Int16:
      return 32767;
    default:
      return 1;
  }
}

}  // namespace tind::gdal
