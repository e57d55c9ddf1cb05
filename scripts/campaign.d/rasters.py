"""Hostile rasters: each with the verdict that it must get, watched from outside."""
import io
import math
import struct
import subprocess
import zipfile
import zlib

from common import figures, programme
from common.hostile import Case, Judge
from common.tiff import FORMS, GEO_4326, place, tiff  # noqa: F401

TIERS = ("ci", "gate", "campaign")
ASKED = "D6, F7: 300 rasters; 0 silent wrong tiles, 0 files outside opened; 512 MB and bounded time each"
WHY_NOT = ("`tind build` reads them, not the daemon, nor the sandbox; for 342 of 1,619 cases, a fifth, any tiles pass that the file may now say ('bounded'): only end, files, "
           "memory and time are judged; a bit flipped where nothing sums up the bits is another height, which passes as GDAL's own tool reads it, too; a file of "
           "megabytes that says it has 5 x 10^11 posts is refused in degrees, for which they are too many; in a CRS that has room for them it is read post by post, as a "
           "DEM of that size is")

WIDE, HIGH = 60, 50
WKT = ('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
       'UNIT["degree",0.0174532925199433]]')


def heights(wide=WIDE, high=HIGH):
    return [[int(900 + 300 * math.sin(x / 7) * math.cos(y / 5) + 40 * ((x * 7 + y * 13) % 5)) for x in range(wide)]
            for y in range(high)]


ROWS = heights()


def grid(rows, head=None, nodata="-9999"):
    return ((head or f"ncols {len(rows[0])}\nnrows {len(rows)}\nxllcorner 8.0\nyllcorner {47 - len(rows) / 1200!r}\n"
             f"cellsize {1 / 1200!r}\nNODATA_value {nodata}\n")
            + "\n".join(" ".join(map(str, row)) for row in rows) + "\n").encode()


def flat_numbers(rows, form="<h"):
    return b"".join(struct.pack(form, v) for row in rows for v in row)


HDR = (f"NROWS {HIGH}\nNCOLS {WIDE}\nNBANDS 1\nNBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER I\nLAYOUT BIL\n"
       f"ULXMAP {8 + 0.5 / 1200!r}\nULYMAP {47 - 0.5 / 1200!r}\nXDIM {1 / 1200!r}\nYDIM {1 / 1200!r}\nNODATA -9999\n")


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(rows, head=None, extra=b""):
    raw = b"".join(b"\0" + struct.pack(f">{len(row)}H", *row) for row in rows)
    head = head or struct.pack(">IIBBBBB", len(rows[0]), len(rows), 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + extra + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


WORLD = f"{1 / 1200!r}\n0\n0\n{-1 / 1200!r}\n{8 + 0.5 / 1200!r}\n{47 - 0.5 / 1200!r}\n".encode()


def zipped(entries, compress=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compress) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return out.getvalue()


def vrt(source, wide=WIDE, high=HIGH, band=None):
    band = band or (f'<SimpleSource><SourceFilename relativeToVRT="0">{source}</SourceFilename><SourceBand>1</SourceBand>'
                    '</SimpleSource>')
    return (f'<VRTDataset rasterXSize="{wide}" rasterYSize="{high}"><SRS>{WKT}</SRS><GeoTransform>8.0, {1 / 1200!r}, 0, '
            f'47.0, 0, {-1 / 1200!r}</GeoTransform><VRTRasterBand dataType="Int16" band="1">{band}</VRTRasterBand>'
            '</VRTDataset>')


def raw_vrt(path):
    return (f'<VRTDataset rasterXSize="8" rasterYSize="8"><SRS>{WKT}</SRS><GeoTransform>8.0, 0.1, 0, 47.0, 0, -0.1'
            '</GeoTransform><VRTRasterBand dataType="Byte" band="1" subClass="VRTRawRasterBand"><SourceFilename '
            f'relativeToVRT="0">{path}</SourceFilename><ImageOffset>0</ImageOffset><PixelOffset>1</PixelOffset>'
            '<LineOffset>8</LineOffset></VRTRasterBand></VRTDataset>')


def mrf(path):
    return (f'<MRF_META><Raster><Size x="64" y="64" c="1"/><PageSize x="64" y="64" c="1"/><Compression>NONE</Compression>'
            f'<DataType>Byte</DataType><DataFile>{path}</DataFile><IndexFile>{path}.idx</IndexFile></Raster></MRF_META>')


def laughs(inner):
    text = '<!DOCTYPE VRTDataset [<!ENTITY a "' + "ha" * 500 + '">'
    for i in range(1, 9):
        text += f'<!ENTITY {chr(97 + i)} "' + f"&{chr(96 + i)};" * 10 + '">'
    return text + "]>" + inner.replace("<SRS>", "<SRS>&i;", 1)


def disguises():
    secret = {"secret.bin": b"root:x:0:0:" * 64}
    bodies = {"raw VRT": raw_vrt("{far}/secret.bin"), "MRF": mrf("{far}/planted"), "VRT": vrt("{far}/secret.bin"),
              "VRT of a URL": vrt("/vsicurl/http://127.0.0.1:18099/a.tif"),
              "VRT of a zip": vrt("/vsizip/{far}/secret.bin/a.tif"),
              "WMS": '<GDAL_WMS><Service name="TMS"><ServerUrl>http://127.0.0.1:18099/${z}</ServerUrl></Service></GDAL_WMS>',
              "warped VRT": '<VRTDataset rasterXSize="9" rasterYSize="9" subClass="VRTWarpedDataset"><GDALWarpOptions>'
                            '<SourceDataset>{far}/secret.bin</SourceDataset></GDALWarpOptions></VRTDataset>',
              "python VRT": vrt("", band='<SourceTransferType>Int16</SourceTransferType><PixelFunctionType>f</PixelFunctionType>'
                                         '<PixelFunctionLanguage>Python</PixelFunctionLanguage><PixelFunctionCode><![CDATA['
                                         'import os\ndef f(*a): os.system("touch {far}/planted")]]></PixelFunctionCode>'),
              "shell script": "#!/bin/sh\ntouch {far}/planted\n", "nothing": "", "zeros": "\0" * 4096,
              "GeoJSON": '{"type":"FeatureCollection","features":[]}', "HTML": "<html><body>404</body></html>"}
    for ending in ("tif", "hgt", "asc", "dem", "img", "png", "bil", "dt1", "flt"):
        for name, body in bodies.items():
            yield Case(f"{name} called .{ending}", {f"N47E008.{ending}": body}, "refused", far=secret)


def names():
    sound = tiff(ROWS)
    for name in ("/vsicurl/http://127.0.0.1:18099/a.tif", "/vsicurl_streaming/http://127.0.0.1:18099/a.tif",
                 "/vsis3/bucket/a.tif", "/vsigs/bucket/a.tif", "/vsiaz/b/a.tif", "/vsihdfs/a.tif", "/vsiwebhdfs/http://127.0.0.1:1/a",
                 "/vsizip/{dir}/a.zip/a.tif", "/vsitar/{dir}/a.tar/a.tif", "/vsigzip/{0}", "/vsistdin/", "/vsimem/a.tif",
                 "/vsisubfile/0_100,{0}", "/vsicrypt/key=a,file={0}", "/vsisparse/{0}", "/vsicached?file={0}", "/vsipipe/ls",
                 "ftp://127.0.0.1:18099/a.tif", "file://{0}",
                 "GTIFF_DIR:1:{0}", "GTIFF_DIR:off:8:{0}", "GTIFF_RAW:{0}", "MEM:::DATAPOINTER=1,PIXELS=9,LINES=9",
                 "NETCDF:{0}:a", "HDF5:{0}://a", "PG:host=127.0.0.1", "WMS:http://127.0.0.1:18099/", "vrt://{0}",
                 "ZARR:{0}", "DERIVED_SUBDATASET:AMPLITUDE:{0}", raw_vrt("{far}/secret.bin"), mrf("{far}/planted"),
                 "{dir}/../far/../case/none.tif", "", "/dev/zero", "/dev/full", "/proc/self/mem", "{0}\n", " {0}"):
        yield Case(f"the name {name[:60]}", {"a.tif": sound}, "refused", args=[name], far={"secret.bin": b"x" * 64})


def tagged(name, verdict, tags, rows=ROWS, **more):
    return Case(name, {"a.tif": tiff(rows, tags=tags, **more)}, verdict)


def lying_sizes():
    for what, number in (("width", 256), ("height", 257)):
        for value in (0, 1, 59, 61, 65536, 740000, 2**31 - 1, 2**31, 2**32 - 1):
            yield tagged(f"{what} {value}", "sound" if value in (59, 1) else "bounded", {number: (4, [value])})
    yield tagged("2^31 x 2^31", "refused", {256: (4, [2**31 - 1]), 257: (4, [2**31 - 1])})
    for side in (16, 256, 4096):
        yield tagged(f"740,000 x 740,000 in {side} x {side}", "refused", {256: (4, [740000]), 257: (4, [740000])}, tile=(side, side))
    for bits in (0, 1, 2, 7, 12, 15, 17, 24, 33, 64, 128, 65535):
        yield tagged(f"{bits} bits", "bounded", {258: (3, [bits])})
    for code in (0, 2, 3, 4, 5, 6, 7, 9, 99, 32766, 32773, 32809, 34661, 34712, 34887, 34925, 50000, 50001, 65535):
        yield tagged(f"compression {code} that is none", "bounded", {259: (3, [code])})
    for code in (0, 3, 4, 5, 6, 7, 65535):
        yield tagged(f"sample format {code}", "bounded", {339: (3, [code])})
    for code in (0, 2, 3, 99):
        yield tagged(f"predictor {code}", "bounded", {317: (3, [code])}, compress=8)
    for code in (0, 2, 3, 5, 6, 8, 32844, 65535):
        yield tagged(f"photometric {code}", "bounded", {262: (3, [code])})
    for count in (0, 2, 65, 1000, 10000, 65535):
        yield tagged(f"{count} bands", "refused" if count != 0 else "bounded", {277: (3, [count])})
    for code in (0, 2, 3):
        yield tagged(f"planar {code}", "bounded", {284: (3, [code])})
    for code in range(2, 9):
        yield tagged(f"orientation {code}", "bounded", {274: (3, [code])})
    for value in (0, 1, 7, 9, 49, 51, 2**31, 2**32 - 1):
        yield tagged(f"{value} rows a strip", "bounded", {278: (4, [value])})
    for wide, high in ((0, 0), (1, 1), (15, 17), (16, 0), (65536, 65536), (2**31 - 16, 16), (2**32 - 16, 2**32 - 16)):
        yield tagged(f"tiles of {wide} x {high}", "bounded", {322: (4, [wide]), 323: (4, [high])}, tile=(16, 16))
    yield tagged("no tile width", "refused", {322: None}, tile=(16, 16))
    for number in (256, 257, 258, 259, 262, 273, 277, 278, 279, 284, 339):
        yield tagged(f"without tag {number}", "refused" if number in (256, 257) else "bounded", {number: None})


def lying_blocks():
    sound = tiff(ROWS)
    count = 7
    for name, offsets in (("beyond the file", [len(sound) + 9] * count), ("at 2^32 - 1", [2**32 - 1] * count),
                          ("in the header", [0, 1, 2, 3, 4, 5, 6]), ("one too few", [8] * (count - 1)), ("none", [])):
        yield tagged(f"offsets {name}", "bounded" if name in ("in the header", "one too few", "none") else "refused", {273: (4, offsets)})
    for name, sizes in (("of 2^32 - 1", [2**32 - 1] * count), ("of 1", [1] * count), ("one too few", [960] * 6), ("none", [])):
        yield tagged(f"strip sizes {name}", "bounded", {279: (4, sizes)})
        yield tagged(f"strip sizes {name}, deflated", "bounded", {279: (4, sizes)}, compress=8)
    for share in (1, 2, 6, 7):
        yield tagged(f"{share} strips were never written", "bounded", {}, sparse=range(share))
    for share in (1, 5, 16):
        yield tagged(f"{share} tiles were never written", "bounded", {}, tile=(16, 16), sparse=range(share), compress=8)
    yield tagged("directory that follows itself", "same", {}, next_is="itself")
    yield tagged("directory that follows beyond the file", "refused", {}, next_is=2**31)
    yield tagged("two directories in a ring", "bounded", {}, overviews=[heights(30, 25)], next_is=8)
    yield tagged("sub-directories at itself", "refused", {330: (4, [8, 8, 8])})
    yield tagged("sub-directories beyond the file", "refused", {330: (4, [2**31] * 50)})
    yield tagged("an overview of other heights", "same", {}, overviews=[[[9000] * 30] * 25])
    yield tagged("an overview that is larger", "same", {}, overviews=[heights(600, 500)])
    yield Case("an overview that is cut off", {"a.tif": tiff(ROWS, overviews=[heights(30, 25)])[:-40]}, "sound")
    yield Case("first directory beyond the file", {"a.tif": sound[:4] + struct.pack("<I", 2**31) + sound[8:]}, "refused")
    yield Case("first directory at the mark", {"a.tif": sound[:4] + struct.pack("<I", 0) + sound[8:]}, "refused")
    yield Case("odd version", {"a.tif": b"II\x2b\0" + sound[4:]}, "refused")
    yield Case("the other byte order", {"a.tif": b"MM" + sound[2:]}, "refused")
    entries = bytearray(sound)
    at = struct.unpack_from("<I", sound, 4)[0]
    struct.pack_into("<H", entries, at, 65535)
    yield Case("65535 entries", {"a.tif": bytes(entries)}, "bounded")
    for number in (256, 273, 33550, 34735, 42113):
        big = bytearray(tiff(ROWS, tags={42113: (2, b"-9999\0")}))
        at = struct.unpack_from("<I", big, 4)[0]
        for i in range(struct.unpack_from("<H", big, at)[0]):
            if struct.unpack_from("<H", big, at + 2 + 12 * i)[0] == number:
                struct.pack_into("<I", big, at + 2 + 12 * i + 4, 2**32 - 1)
        yield Case(f"tag {number} says that it has 2^32 - 1 values", {"a.tif": bytes(big)}, "bounded")


def lying_places():
    nan, inf = math.nan, math.inf
    for name, scale in (("0", 0.0), ("NaN", nan), ("inf", inf), ("-1", -1.0), ("1e-300", 1e-300), ("1e300", 1e300), ("1e-12", 1e-12), ("90", 90.0)):
        yield tagged(f"pixels of {name}", "refused" if name in ("0", "NaN", "inf", "1e300") else "bounded", {33550: (12, [scale, scale, 0.0])})
    for name, at in (("NaN", nan), ("inf", inf), ("1e300", 1e300), ("-1e300", -1e300), ("361", 361.0), ("1e9", 1e9)):
        for axis in ("west", "north"):
            where = [0.0, 0.0, 0.0, at if axis == "west" else 8.0, at if axis == "north" else 47.0, 0.0]
            yield tagged(f"{axis} at {name}", "bounded" if name == "361" and axis == "west" else "refused", {33922: (12, where)})
    step = 1 / 1200
    for name, m in (("rotated", [step, step, 0, 8, step, -step, 0, 47]), ("singular", [step, step, 0, 8, step, step, 0, 47]),
                    ("sheared", [step, step / 2, 0, 8, 0, -step, 0, 47]), ("NaN", [nan, 0, 0, 8, 0, -step, 0, 47]),
                    ("zero", [0] * 8), ("quarter turn", [0, step, 0, 8, step, 0, 0, 47]), ("mirrored", [-step, 0, 0, 8.05, 0, -step, 0, 47])):
        matrix = [float(v) for v in m] + [0.0] * 4 + [0.0, 0.0, 0.0, 1.0]
        yield tagged(f"matrix: {name}", "bounded" if name in ("mirrored", "rotated", "quarter turn", "sheared") else "refused",
                     {33550: None, 33922: None, 34264: (12, matrix)})
    yield tagged("5000 tie points", "refused", {33550: None, 33922: (12, [float(i) for i in range(30000)])})
    yield tagged("no place", "refused", {33550: None, 33922: None})
    yield tagged("tie points of 5 numbers", "bounded", {33922: (12, [0.0] * 5)})
    for name, keys in (("none", None), ("an unknown code", GEO_4326[:-1] + [65000]), ("too many for the tag", [1, 1, 0, 9999] + GEO_4326[4:]),
                       ("of version 9", [9, 9, 9, 3] + GEO_4326[4:]), ("not in order", GEO_4326[:4] + GEO_4326[8:12] + GEO_4326[4:8] + GEO_4326[12:]),
                       ("text beyond its tag", [1, 1, 0, 4] + GEO_4326[4:] + [1026, 34737, 60000, 60000]),
                       ("user-defined without anything", [1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 32767]),
                       ("a projection of 0", [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 0])):
        yield tagged(f"geo keys: {name}", "bounded", {34735: (3, keys) if keys else None})


def lying_words():
    for value in ("nan", "-inf", "inf", "1e999", "abc", "", "-9999", "1e-320", "0x10", "9" * 5000, "900"):
        yield tagged(f"nodata {value[:12]!r}", "bounded", {42113: (2, value.encode() + b"\0")})
    item = "<GDALMetadata><Item name='{}' sample='0' role='{}'>{}</Item></GDALMetadata>"
    for role, values in (("scale", ("nan", "inf", "0", "1e300", "-1", "abc")), ("offset", ("nan", "-inf", "1e300", "1e6", "abc")),
                         ("unittype", ("furlong", "ft", "", "m\0n", "x" * 70000))):
        for value in values:
            name = {"scale": "SCALE", "offset": "OFFSET", "unittype": "UNITTYPE"}[role]
            verdict = "refused" if value in ("nan", "inf", "-inf", "1e300", "furlong") else "bounded"
            yield tagged(f"{role} {value[:8]!r}", verdict, {42112: (2, item.format(name, role, value).encode() + b"\0")})
    yield tagged("metadata of a billion laughs", "same", {42112: (2, laughs("<GDALMetadata><SRS></GDALMetadata>").encode() + b"\0")})
    yield tagged("metadata nested 100,000 deep", "same", {42112: (2, b"<a>" * 100000 + b"\0")})
    yield tagged("metadata of 8 MB", "same", {42112: (2, b"<GDALMetadata>" + b"<Item name='a'>b</Item>" * 350000 + b"</GDALMetadata>\0")})
    yield tagged("metadata that names an external entity", "same", {42112: (2, b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><GDALMetadata><Item name="a">&x;</Item></GDALMetadata>\0')})
    for kind, value in (("f4", math.nan), ("f4", math.inf), ("f4", 3e38), ("f4", 20000.0), ("f8", 1e300), ("i4", 2**31 - 1), ("u4", 2**32 - 1), ("u2", 65535), ("i2", -32768)):
        rows = [list(row) for row in ROWS]
        rows[20][30] = value
        verdict = "refused" if value in (2**31 - 1, 2**32 - 1) else "bounded"
        yield Case(f"one post of {value:g} in {kind}", {"a.tif": tiff(rows, kind)}, verdict)
    for kind, value in (("f4", math.nan), ("f8", math.nan), ("f4", math.inf), ("f4", 3e38)):
        yield Case(f"all posts of {value:g} in {kind}", {"a.tif": tiff([[value] * WIDE] * HIGH, kind)}, "refused")


def bombs():
    one = {256: (4, [20000]), 257: (4, [20000]), 322: (4, [20000]), 323: (4, [20000])}
    rows, tile = [[0] * 16] * 16, (16, 16)
    yield Case("one block of 20,000 x 20,000", {"a.tif": lambda: bomb(rows, tile, one, 800 << 20)}, "refused")
    yield Case("blocks of 16 x 16 that unpack to 800 MB", {"a.tif": lambda: bomb(rows, tile, {}, 800 << 20)}, "bounded")
    wide = {256: (4, [17000000]), 257: (4, [2]), 278: (4, [2])}
    yield Case("strips of 17,000,000 posts", {"a.tif": tiff(rows, rows_per_strip=16, compress=8, tags=wide)}, "refused")
    hgt = "N47E008.hgt"
    yield Case("zip of 1 GB", {hgt + ".zip": lambda: huge_zip(hgt, 1 << 30)}, "refused")
    yield Case("zip that says 2,884,802 and holds 1 GB", {hgt + ".zip": lambda: huge_zip(hgt, 1 << 30, 1201 * 1201 * 2)}, "refused")
    yield Case("zip in a zip", {"a.tif.zip": zipped({"a.tif": zipped({"a.tif": tiff(ROWS)})})}, "refused")
    yield Case("zip of two rasters", {"a.tif.zip": zipped({"a.tif": tiff(ROWS), "b.tif": tiff(ROWS)})}, "refused")
    yield Case("zip of a VRT", {"a.tif.zip": zipped({"a.tif": raw_vrt("/etc/passwd")})}, "refused")
    yield Case("zip of nothing", {"a.tif.zip": zipped({})}, "refused")
    for name in ("../a.tif", "/a.tif", "C:\\a.tif", "x/../../a.tif", "a\0b.tif", "a.tif/"):
        yield Case(f"zip whose file is called {name!r}", {"a.tif.zip": zipped({name: tiff(ROWS)})}, "bounded")
    sound = zipped({"a.tif": tiff(ROWS)})
    for at, name in ((14, "CRC"), (18, "packed size"), (22, "size"), (26, "length of the name"), (8, "method"), (6, "flags")):
        for value in (0, 1, 0xffff):
            lie = bytearray(sound)
            central = sound.find(b"PK\1\2")
            struct.pack_into("<H", lie, at, value)
            struct.pack_into("<H", lie, central + at + 2, value)
            yield Case(f"zip with {value} as {name}", {"a.tif.zip": bytes(lie)}, "sound" if name == "CRC" else "bounded")
    yield Case("a zip whose comment holds another", {"a.tif.zip": sound[:-2] + struct.pack("<H", 22) + sound[-22:]}, "bounded")


def bomb(rows, tile, tags, size):
    """A TIFF whose one block unpacks to `size` zeros."""
    zeros = zlib.compressobj(1)
    packed = b"".join(zeros.compress(bytes(1 << 20)) for _ in range(size >> 20)) + zeros.flush()
    made = bytearray(tiff(rows, tile=tile, compress=8))
    at = len(made) + len(made) % 2
    return tiff(rows, tile=tile, compress=8, tags={324: (4, [at + 4096]), 325: (4, [len(packed)])} | tags).ljust(at + 4096, b"\0") + packed


def huge_zip(name, size, says=None):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open(name, "w") as entry:
            for _ in range(size >> 20):
                entry.write(bytes(1 << 20))
    data = bytearray(out.getvalue())
    if says:
        struct.pack_into("<I", data, 22, says)
        struct.pack_into("<I", data, data.rfind(b"PK\1\2") + 24, says)
    return bytes(data)


def sidecars():
    sound = tiff(ROWS)
    other = ROWS[::-1]
    yield Case("an .aux.xml with other heights", {"a.tif": sound, "a.tif.aux.xml": b"<PAMDataset><PAMRasterBand band='1'><Offset>5000</Offset><Scale>9</Scale><NoDataValue>900</NoDataValue></PAMRasterBand></PAMDataset>"}, "same")
    yield Case("an .aux.xml that names a file", {"a.tif": sound, "a.tif.aux.xml": "<PAMDataset><Metadata domain='OVERVIEWS'><MDI key='OVERVIEW_FILE'>{far}/o.tif</MDI></Metadata></PAMDataset>"}, "same", far={"o.tif": tiff(other)})
    yield Case("an .ovr of other heights", {"a.tif": sound, "a.tif.ovr": tiff(heights(30, 25)[::-1])}, "same")
    yield Case("an .ovr that is a VRT", {"a.tif": sound, "a.tif.ovr": raw_vrt("{far}/secret")}, "same", far={"secret": b"x" * 64})
    yield Case("an .ovr that is cut off", {"a.tif": sound, "a.tif.ovr": tiff(heights(30, 25))[:300]}, "same")
    yield Case("an .msk that is cut off", {"a.tif": sound, "a.tif.msk": tiff([[255] * WIDE] * HIGH, "u1")[:300]}, "bounded")
    yield Case("an .msk that is a VRT", {"a.tif": sound, "a.tif.msk": raw_vrt("{far}/secret")}, "bounded", far={"secret": b"x" * 64})
    yield Case("an .msk of another size", {"a.tif": sound, "a.tif.msk": tiff([[255] * 3] * 3, "u1")}, "bounded")
    for name, line in (("NaN", "nan\n0\n0\nnan\n8\n47\n"), ("empty", ""), ("zeros", "0\n" * 6), ("rotated", "1\n1\n1\n1\n8\n47\n"), ("words", "a\nb\nc\nd\ne\nf\n"), ("1 MB", "1" * 1000000)):
        yield Case(f"a world file: {name}", {"a.png": png(ROWS), "a.pgw": line}, "refused", args=["{0}", "--crs", "EPSG:4326"])
        yield Case(f"a world file beside a GeoTIFF: {name}", {"a.tif": sound, "a.tfw": line}, "same")
    grids = ('GEOGCS["x",DATUM["d",SPHEROID["WGS 84",6378137,298.257223563],EXTENSION["PROJ4_GRIDS","{far}/secret.gsb"]],PRIMEM["Greenwich",0],'
             'UNIT["degree",0.0174532925199433]]')
    proj4 = 'LOCAL_CS["x",EXTENSION["PROJ4","+proj=longlat +nadgrids={far}/secret.gsb +no_defs"]]'
    bound = ('BOUNDCRS[SOURCECRS[GEOGCRS["x",DATUM["d",ELLIPSOID["e",6378137,298.3]],CS[ellipsoidal,2],AXIS["lat",north],AXIS["lon",east],ANGLEUNIT["degree",0.0174532925199433]]],'
             'TARGETCRS[GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],AXIS["lat",north],AXIS["lon",east],ANGLEUNIT["degree",0.0174532925199433]]],'
             'ABRIDGEDTRANSFORMATION["t",METHOD["NTv2",ID["EPSG",9615]],PARAMETERFILE["Latitude and longitude difference file","{far}/secret.gsb"]]]')
    geoid = ('COMPD_CS["c",' + WKT + ',VERT_CS["v",VERT_DATUM["d",2005,EXTENSION["PROJ4_GRIDS","{far}/secret.gtx"]],UNIT["metre",1],AXIS["Up",UP]]]')
    for name, text in (("that names a grid", grids), ("of PROJ.4 that names a grid", proj4), ("with a bound grid", bound), ("that names a geoid", geoid),
                       ("of a URL", "http://127.0.0.1:18099/crs"), ("of 10 MB", "PROJCS[" * 1400000), ("of nothing", ""), ("of a pipeline", "+proj=pipeline +step +proj=vgridshift +grids={far}/secret.gtx"),
                       ("that is another file", "@{far}/secret.gtx"), ("of zeros", "\0" * 100)):
        yield Case(f"a .prj {name}", {"a.asc": grid(ROWS), "a.prj": text}, "bounded", far={"secret.gsb": b"x" * 999, "secret.gtx": b"x" * 999})


def headers():
    numbers = flat_numbers(ROWS)
    yield Case(".bil", {"a.bil": numbers, "a.hdr": HDR, "a.prj": WKT}, "same")
    for key, values in (("NROWS", ("0", "-1", "51", "2147483647", "1e9", "nan")), ("NCOLS", ("0", "-1", "61", "2147483647", "x")),
                        ("NBITS", ("0", "1", "7", "32", "64", "-16")), ("NBANDS", ("0", "2", "100000")), ("LAYOUT", ("BSQ", "BIP", "XYZ")),
                        ("BYTEORDER", ("M", "X")), ("XDIM", ("0", "nan", "-1", "1e300")), ("ULXMAP", ("nan", "1e300", "")), ("PIXELTYPE", ("FLOAT", "X"))):
        for value in values:
            lie = "".join(f"{key} {value}\n" if line.startswith(key + " ") else line for line in HDR.splitlines(True))
            yield Case(f".hdr with {key} {value}", {"a.bil": numbers, "a.hdr": lie, "a.prj": WKT}, "bounded")
    for more in ("SKIPBYTES 9223372036854775807", "SKIPBYTES -100", "BANDROWBYTES -1", "TOTALROWBYTES 1", "BANDGAPBYTES 2147483647", "x" * 2000000):
        yield Case(f".hdr with {more[:30]}", {"a.bil": numbers, "a.hdr": HDR + more + "\n", "a.prj": WKT}, "bounded")
    yield Case("ASCII grid", {"a.asc": grid(ROWS), "a.prj": WKT}, "same")
    base = "ncols {}\nnrows {}\nxllcorner {}\nyllcorner 46.95833333333333\ncellsize {}\nNODATA_value {}\n"
    for name, values in (("ncols 0", (0, HIGH, 8, 1 / 1200, -9999)), ("ncols -5", (-5, HIGH, 8, 1 / 1200, -9999)), ("ncols 2^31", (2**31, HIGH, 8, 1 / 1200, -9999)),
                         ("ncols 1e9", (10**9, HIGH, 8, 1 / 1200, -9999)), ("nrows 51", (WIDE, 51, 8, 1 / 1200, -9999)), ("a cell of 0", (WIDE, HIGH, 8, 0, -9999)),
                         ("a cell of nan", (WIDE, HIGH, 8, "nan", -9999)), ("a cell of -1", (WIDE, HIGH, 8, -1, -9999)), ("west of nan", (WIDE, HIGH, "nan", 1 / 1200, -9999)),
                         ("west of 1e999", (WIDE, HIGH, "1e999", 1 / 1200, -9999)), ("ncols 100000 of nrows 100000", (100000, 100000, 8, 1e-5, -9999))):
        yield Case(f"ASCII grid with {name}", {"a.asc": grid(ROWS, base.format(*values)), "a.prj": WKT}, "refused")
    for word in ("1e400", "nan", "inf", "--5", "0x12", "1,5", "5" * 100000, "\0", "abc", "1.2.3", "1e", "+-1"):
        rows = [list(row) for row in ROWS]
        rows[20][30] = word
        yield Case(f"ASCII grid with a post of {word[:10]!r}", {"a.asc": grid(rows), "a.prj": WKT}, "bounded" if word in ("nan", "inf", "1e400", "1,5") else "refused")
    cut = [list(row) for row in ROWS]
    cut[-1] = cut[-1][:-1]
    yield Case("ASCII grid with a post too few", {"a.asc": grid(cut), "a.prj": WKT}, "refused")
    here = {"args": ["{0}", "--crs", "EPSG:4326"]}
    yield Case("PNG", {"a.png": png(ROWS), "a.pgw": WORLD}, "same", **here)
    for name, head in (("of 0", (0, HIGH, 16, 0, 0, 0, 0)), ("of 2^31 - 1", (2**31 - 1, 2**31 - 1, 16, 0, 0, 0, 0)), ("of 40,000", (40000, 40000, 16, 0, 0, 0, 0)), ("of 3 bits", (WIDE, HIGH, 3, 0, 0, 0, 0)),
                       ("of colour type 9", (WIDE, HIGH, 16, 9, 0, 0, 0)), ("interlaced", (WIDE, HIGH, 16, 0, 0, 0, 1)), ("with filter 9", (WIDE, HIGH, 16, 0, 0, 9, 0)), ("one row higher", (WIDE, HIGH + 1, 16, 0, 0, 0, 0))):
        yield Case(f"PNG {name}", {"a.png": png(ROWS, struct.pack(">IIBBBBB", *head)), "a.pgw": WORLD}, "refused", **here)
    for kind, name in ((b"zTXt", "text"), (b"iCCP", "profile")):
        def swollen(kind=kind):
            return png(ROWS, extra=chunk(kind, b"a\0\0" + zlib.compress(bytes(300 << 20), 1)))
        yield Case(f"PNG with a {name} of 300 MB", {"a.png": swollen, "a.pgw": WORLD}, "bounded", **here)


def vrts():
    allowed = {"args": ["{0}", "--allow-vrt"]}
    sound = {"a.tif": tiff(ROWS)}
    yield Case("VRT", {"v.vrt": vrt("{dir}/a.tif"), **sound}, "same", **allowed)
    yield Case("VRT without being told", {"v.vrt": vrt("{dir}/a.tif"), **sound}, "refused")
    yield Case("VRT of itself", {"v.vrt": vrt("{dir}/v.vrt")}, "refused", **allowed)
    yield Case("two VRTs of each other", {"v.vrt": vrt("{dir}/w.vrt"), "w.vrt": vrt("{dir}/v.vrt")}, "refused", **allowed)
    ring = {f"{i}.vrt": vrt(f"{{dir}}/{(i + 1) % 60}.vrt") for i in range(60)}
    yield Case("a ring of 60 VRTs", ring, "refused", **allowed)
    chain = {f"{i}.vrt": vrt(f"{{dir}}/{i + 1}.vrt") for i in range(300)} | {"300.vrt": vrt("{dir}/a.tif"), **sound}
    yield Case("a chain of 300 VRTs", chain, "bounded", **allowed)
    fan = {f"{i}.vrt": vrt("", band=one_source(f"{{dir}}/{i + 1}.vrt") * 10) for i in range(9)} | {"9.vrt": vrt("{dir}/a.tif"), **sound}
    yield Case("nine VRTs, each ten times the next", fan, "bounded", **allowed)
    yield Case("VRT of a file that is not there", {"v.vrt": vrt("{dir}/none.tif")}, "refused", **allowed)
    yield Case("VRT of a URL", {"v.vrt": vrt("/vsicurl/http://127.0.0.1:18099/a.tif")}, "refused", **allowed)
    yield Case("VRT of a stream", {"v.vrt": vrt("/vsicurl_streaming/http://127.0.0.1:18099/a.tif")}, "refused", **allowed)
    yield Case("VRT of a bucket", {"v.vrt": vrt("/vsis3/bucket/a.tif")}, "refused", **allowed)
    yield Case("VRT of stdin", {"v.vrt": vrt("/vsistdin/")}, "refused", **allowed)
    yield Case("VRT of memory", {"v.vrt": vrt("MEM:::DATAPOINTER=4096,PIXELS=60,LINES=50,DATATYPE=Int16")}, "refused", **allowed)
    yield Case("VRT of an MRF", {"v.vrt": vrt("{dir}/m.mrf"), "m.mrf": mrf("{far}/planted")}, "refused", **allowed)
    yield Case("VRT of raw numbers", {"v.vrt": raw_vrt("{dir}/secret"), "secret": b"x" * 64}, "bounded", **allowed)
    yield Case("VRT of a billion laughs", {"v.vrt": laughs(vrt("{dir}/a.tif")), **sound}, "bounded", **allowed)
    yield Case("VRT of 20,000 sources", {"v.vrt": vrt("", band=one_source("{dir}/a.tif") * 20000), **sound}, "bounded", **allowed)
    yield Case("VRT nested 100,000 deep", {"v.vrt": "<VRTDataset rasterXSize='9' rasterYSize='9'>" + "<a>" * 100000}, "refused", **allowed)
    yield Case("VRT of 2^31 x 2^31", {"v.vrt": vrt("{dir}/a.tif", 2**31 - 1, 2**31 - 1), **sound}, "refused", **allowed)
    yield Case("VRT of Python", {"v.vrt": vrt("", band='<PixelFunctionType>f</PixelFunctionType><PixelFunctionLanguage>Python</PixelFunctionLanguage><PixelFunctionCode>import os; os.system("touch {far}/planted")</PixelFunctionCode>' + one_source("{dir}/a.tif")), **sound}, "bounded", **allowed)
    yield Case("VRT of an unknown pixel function", {"v.vrt": vrt("{dir}/a.tif").replace('band="1">', 'band="1" subClass="VRTDerivedRasterBand"><PixelFunctionType>none</PixelFunctionType>', 1), **sound}, "refused", **allowed)
    yield Case("VRT of a cut file", {"v.vrt": vrt("{dir}/a.tif"), "a.tif": tiff(ROWS)[:3000]}, "refused", **allowed)
    yield Case("VRT whose source has a NaN window", {"v.vrt": vrt("", band=one_source("{dir}/a.tif", '<SrcRect xOff="nan" yOff="0" xSize="1e300" ySize="-5"/>')), **sound}, "bounded", **allowed)


def one_source(path, more=""):
    return f'<SimpleSource><SourceFilename relativeToVRT="0">{path}</SourceFilename><SourceBand>1</SourceBand>{more}</SimpleSource>'


def kinds(run):
    """Sound files of each format: what is cut and flipped. {name: (files, reference, extra arguments)}"""
    small = run.work / "small.tif"
    overviews = [heights(30, 25)]
    made = {
        "plain strips": ({"a.tif": tiff(ROWS)}, "small", []),
        "deflated tiles": ({"a.tif": tiff(ROWS, compress=8, tile=(16, 16))}, "small", []),
        "LZW": ({"a.tif": tiff(ROWS, compress=5)}, "small", []),
        "packed bits": ({"a.tif": tiff(ROWS, compress=32773)}, "small", []),
        "big-endian": ({"a.tif": tiff(ROWS, endian=">")}, "small", []),
        "BigTIFF": ({"a.tif": tiff(ROWS, compress=8, big=True)}, "small", []),
        "with overviews": ({"a.tif": tiff(ROWS, compress=8, tile=(16, 16), overviews=overviews)}, "small", []),
        "zipped": ({"a.tif.zip": zipped({"a.tif": tiff(ROWS)})}, "small", []),
        "ASCII": ({"a.asc": grid(ROWS), "a.prj": WKT.encode()}, "small", []),
        "BIL": ({"a.bil": flat_numbers(ROWS), "a.hdr": HDR.encode(), "a.prj": WKT.encode()}, "small", []),
        "PNG": ({"a.png": png(ROWS), "a.pgw": WORLD}, "small", ["--crs", "EPSG:4326"]),
    }
    small.write_bytes(tiff(ROWS))
    for name, driver, file, options in (("COG", "COG", "a.tif", ["-co", "BLOCKSIZE=128"]), ("Imagine", "HFA", "a.img", []),
                                        ("Imagine, packed", "HFA", "a.img", ["-co", "COMPRESSED=YES"])):
        path = run.work / file
        done = subprocess.run(["gdal_translate", "-q", "-of", driver, *options, str(small), str(path)], capture_output=True, text=True)
        if done.returncode:
            raise programme.NotHere(f"gdal_translate cannot make {driver}: {done.stderr.strip()}")
        made[name] = ({file: path.read_bytes()}, "small", [])
        path.unlink()
    return made


def damaged(run):
    """Each format cut at every fiftieth, and with one bit, one byte or a run of bytes changed."""
    for name, (files, like, more) in kinds(run).items():
        first, data = next(iter(files.items()))
        rest = {k: v for k, v in files.items() if k != first}
        args = ["{0}", *more]
        for i in range(50):
            # The last number of a text is another number when it is cut: nothing in it could tell.
            verdict = "sound"
            yield Case(f"{name}, cut at {i}/50", {first: data[:len(data) * i // 50], **rest}, verdict, args, like)
        for i in range(20):
            at, bit = run.rng.randrange(len(data)), run.rng.randrange(8)
            flipped = bytearray(data)
            flipped[at] ^= 1 << bit
            yield Case(f"{name}, bit {bit} of byte {at}", {first: bytes(flipped), **rest}, "sound", args, like)
        for i in range(6):
            at, size = run.rng.randrange(min(len(data), 600)), run.rng.choice((1, 2, 4, 8, 64))
            spoiled = data[:at] + run.rng.choice((b"\0", b"\xff", b"\x7f"))*size + data[at + size:]
            yield Case(f"{name}, {size} bytes at {at}", {first: spoiled, **rest}, "bounded", args, like)


def REACHED(rows):
    last = figures.last_whole(rows)
    memory, seconds = figures.numbers(r"at most ([\d,]+) MB, ([\d.]+) s of CPU", figures.beyond_ci(rows) or rows)[-1]
    return {"D6": f"rasters: {last.tried:,} cases in the last row, {last.wrong} wrong; {sum(row.tried for row in rows):,} in all",
            "F7": f"{memory} MB and {seconds} s of CPU at most for any case of the last row"}


GROUPS = (disguises, names, lying_sizes, lying_blocks, lying_places, lying_words, bombs, sidecars, headers, vrts)


def run(run):
    programme.needs("strace", "gdal_translate")
    judge = Judge(run, {"small": ["--levels", "0-9"]})
    sound = run.work / "sound.tif"
    sound.write_bytes(tiff(ROWS))
    judge.reference("small", sound)
    if run.wrong:
        return  # with nothing to compare with
    made_up = [case for group in GROUPS for case in group()]
    cases = made_up + list(damaged(run))
    known = len(cases)
    while True:
        for case in run.sample(cases, 0.06):
            if run.time_left() < 0 and run.tier != "gate":
                break
            judge.try_case(case)
        if run.tier != "campaign" or run.time_left() < 0:
            break
        cases = list(damaged(run))  # other bits; what was made up is the same in every round
    run.note(f"{known} cases, {judge.built} built, the others refused; at most {judge.peak:.0f} MB, {judge.cpu:.1f} s of CPU")
