#!/usr/bin/python3
"""GDAL as a client of OGC API: by its driver OGCAPI the coverage of a dataset is the DEM itself, post by post."""
import os
import pathlib
import sys
import tempfile

try:
    import numpy as np
    from osgeo import gdal
    from web_map import Daemon
except ImportError:
    sys.exit(77)

gdal.UseExceptions()
DEM = pathlib.Path(__file__).resolve().parents[2] / "testdata" / "rainier.tif"


def heights(path, nodata):
    values = gdal.Open(str(path)).ReadAsArray().astype(float)
    values[values == nodata] = np.nan
    return values


def main():
    if gdal.GetDriverByName("OGCAPI") is None:
        sys.exit(77)
    os.chdir(tempfile.mkdtemp())  # the driver keeps its cache here
    daemon = Daemon([DEM])
    try:
        base = f"OGCAPI:http://{daemon.address}"
        assert gdal.Open(f"{base}/").GetSubDatasets()[0][0] == f"{base}/collections/rainier"
        theirs, own = heights(f"{base}/collections/rainier", -9999), heights(DEM, -32768)
        assert theirs.shape == own.shape, theirs.shape
        np.testing.assert_array_equal(theirs, own)
        window = gdal.Open(f"{base}/collections/rainier")
        assert np.allclose(window.GetGeoTransform(), gdal.Open(str(DEM)).GetGeoTransform(), rtol=0, atol=1e-9)
    finally:
        daemon.stop()
    print(f"{np.isfinite(own).sum()} heights are the DEM's")


main()
