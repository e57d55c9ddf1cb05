#pragma once
// GDAL takes any of its options out of the environment: where posts lie, how numbers are read,
// whether a server's certificate counts. What a program says of heights must not depend on it.

namespace tind::cli {

/// Takes GDAL's variables out of the environment, but those that say where its files are, how much
/// it may keep, and which proxy or certificates there are. Before there are threads.
void forget_gdal_options();

}  // namespace tind::cli
