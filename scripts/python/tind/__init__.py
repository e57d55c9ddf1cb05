"""tind from Python: heights, meshes and analyses of terrain.

    import tind

    alps = tind.Client("http://127.0.0.1:8080")
    alps.elevation("alps", 7.66, 45.98).height_m
    alps.simplify("alps", bbox=(7.6, 45.9, 7.8, 46.1), max_error=2).save("matterhorn.ply")

    local = tind.Program()          # the same, by the program on this machine
    local.simplify("alps.tif", max_error=2).save("alps.ply")

Nothing but the standard library is needed. Places may come as numpy arrays or as points of
geopandas; then heights come as an array.
"""
from tind.client import Client
from tind.errors import TindError
from tind.heights import Height, Heights
from tind.jobs import Job, Result
from tind.program import Program

__all__ = ["Client", "Height", "Heights", "Job", "Program", "Result", "TindError"]
