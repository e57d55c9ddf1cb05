#!/usr/bin/python3
"""A reader of BTG files of version 7 and 10, written from the format's description in SimGear's
sg_binobj.hxx and nothing of tind's: prints what is in them, vertices as doubles in ECEF.

header:  u16 version, u16 "SG", u32 when, count of objects
object:  u8 kind, count of properties, count of elements, properties, elements
property: u8 kind, u32 bytes, bytes;  element: u32 bytes, bytes
A count has two bytes, from version 10 on four; so has an index of a corner. All little endian.
"""
import gzip
import struct
import sys

SPHERE, VERTICES, NORMALS, TEXCOORDS, TRIANGLES = 0, 1, 2, 3, 10
MATERIAL, INDEX_TYPES = 0, 1
HAS_VERTEX, HAS_NORMAL, HAS_COLOUR, HAS_TEXCOORD = 1, 2, 4, 8


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def block(self):
        size = self.take("I")
        if self.at + size > len(self.data):
            sys.exit("an element is longer than the file")
        self.at += size
        return self.data[self.at - size:self.at]


def show(path):
    r = Reader(gzip.open(path).read())
    version, magic, _ = r.take("HHI")
    if magic != 0x5347 or version not in (7, 10):
        sys.exit(f"{path}: no BTG of version 7 or 10")
    count = "I" if version == 10 else "H"
    center, parts = None, []
    for _ in range(r.take(count)):
        kind, properties, elements = r.take("B"), r.take(count), r.take(count)
        material, mask = "", HAS_VERTEX | HAS_TEXCOORD
        for _ in range(properties):
            which, data = r.take("B"), r.block()
            if which == MATERIAL:
                material = data.decode()
            elif which == INDEX_TYPES:
                mask = data[0]
        for _ in range(elements):
            data = r.block()
            if kind == SPHERE:
                *center, radius = struct.unpack("<dddf", data)
                print("version %d center %.17g %.17g %.17g radius %.9g" % (version, *center, radius))
            elif kind == VERTICES:
                for v in struct.iter_unpack("<fff", data):
                    print("v %.17g %.17g %.17g" % tuple(c + x for c, x in zip(center, v)))
            elif kind == NORMALS:
                for n in struct.iter_unpack("BBB", data):
                    n = [x / 127.5 - 1 for x in n]
                    length = sum(x * x for x in n) ** 0.5
                    print("n %.9g %.9g %.9g" % tuple(x / length for x in n))
            elif kind == TEXCOORDS:
                for t in struct.iter_unpack("<ff", data):
                    print("t %.9g %.9g" % t)
            elif kind == TRIANGLES:
                if mask != HAS_VERTEX | HAS_NORMAL | HAS_TEXCOORD:
                    sys.exit(f"{path}: corners of other things than a vertex, a normal and a texture coordinate")
                corners = list(struct.iter_unpack("<" + count * 3, data))
                parts.append((material, corners))
    if r.at != len(r.data):
        sys.exit(f"{path}: {len(r.data) - r.at} bytes follow the last object")
    for material, corners in parts:
        print("part", material, len(corners), len(corners), len(corners))
        for corner in corners:
            print("c %d %d %d" % corner)


for name in sys.argv[1:]:
    show(name)
