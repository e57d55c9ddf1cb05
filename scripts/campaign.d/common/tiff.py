"""A writer of GeoTIFF that can lie: any tag may be replaced or left out, any block may be missing or another's."""
import struct
import zlib

CODES = {"i1": (2, 8, "b"), "u1": (1, 8, "B"), "i2": (2, 16, "h"), "u2": (1, 16, "H"), "i4": (2, 32, "i"),
         "u4": (1, 32, "I"), "f4": (3, 32, "f"), "f8": (3, 64, "d")}
FORMS = {1: "B", 2: "s", 3: "H", 4: "I", 5: "II", 7: "s", 11: "f", 12: "d", 13: "I", 16: "Q"}
GEO_4326 = [1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326]


def lzw(data):
    """LZW without a dictionary: a clear code before every 200 bytes. Right, and twice as long."""
    bits = []
    for at in range(0, max(1, len(data)), 200):
        bits.append(256)
        bits += data[at:at + 200]
    bits.append(257)
    number = 0
    for code in bits:
        number = number << 9 | code
    pad = -len(bits) * 9 % 8
    return (number << pad).to_bytes((len(bits) * 9 + pad) // 8, "big")


def packbits(data):
    return b"".join(bytes([len(part) - 1]) + part for part in (data[i:i + 128] for i in range(0, len(data), 128)))


PACK = {1: bytes, 5: lzw, 8: zlib.compress, 32773: packbits, 32946: zlib.compress}


def blocks_of(rows, kind, endian, tile, rows_per_strip):
    form = CODES[kind][2]
    wide, high = len(rows[0]), len(rows)
    across, down = tile or (wide, rows_per_strip)
    for top in range(0, high, down):
        for left in range(0, wide, across):
            lines = []
            for y in range(top, top + down if tile else min(top + down, high)):
                line = list(rows[min(y, high - 1)][left:left + across])
                line += [0] * (across - len(line))
                lines.append(struct.pack(f"{endian}{across}{form}", *line))
            yield b"".join(lines)


class Tiff:
    def __init__(self, big=False, endian="<"):
        self.big, self.endian = big, endian
        mark = b"II" if endian == "<" else b"MM"
        self.data = bytearray(mark + struct.pack(endian + ("HHHQ" if big else "HI"), *((43, 8, 0, 0) if big else (42, 0))))
        self.link = len(self.data) - (8 if big else 4)

    def put(self, data):
        if len(self.data) % 2:
            self.data += b"\0"
        at = len(self.data)
        self.data += data
        return at

    def directory(self, tags, next_is=None):
        """tags: {number: (type, values)}; `values` bytes for text, else a list."""
        word, entry = ("Q", 20) if self.big else ("I", 12)
        room = 8 if self.big else 4
        lines = []
        for number, (kind, values) in sorted(tags.items()):
            count = len(values)
            form = FORMS[kind]
            raw = bytes(values) if form == "s" else struct.pack(f"{self.endian}{count}{form}", *values)
            if len(raw) > room:
                raw = struct.pack(self.endian + word, self.put(raw))
            lines.append(struct.pack(self.endian + "HH" + word, number, kind, count) + raw.ljust(room, b"\0"))
        head = struct.pack(self.endian + ("Q" if self.big else "H"), len(lines))
        at = self.put(head + b"".join(lines) + b"\0" * room)
        struct.pack_into(self.endian + word, self.data, self.link, at)
        self.link = at + len(head) + len(lines) * entry
        if next_is is not None:
            struct.pack_into(self.endian + word, self.data, self.link, at if next_is == "itself" else next_is)


def image(out, rows, kind, compress, tile, rows_per_strip, bands, sparse, tags):
    """One directory with its blocks; gives nothing back, as the next one links itself."""
    blocks = list(blocks_of(rows, kind, out.endian, tile, rows_per_strip or len(rows))) * bands
    packed = [PACK.get(compress, bytes)(b) for b in blocks]
    at = [0 if i in sparse else out.put(p) for i, p in enumerate(packed)]
    sizes = [0 if i in sparse else len(p) for i, p in enumerate(packed)]
    form, bits, _ = CODES[kind]
    mine = {256: (4, [len(rows[0])]), 257: (4, [len(rows)]), 258: (3, [bits] * bands), 259: (3, [compress]),
            262: (3, [1]), 277: (3, [bands]), 284: (3, [2 if bands > 1 else 1]), 339: (3, [form] * bands)}
    longs = 16 if out.big else 4
    if tile:
        mine |= {322: (4, [tile[0]]), 323: (4, [tile[1]]), 324: (longs, at), 325: (longs, sizes)}
    else:
        mine |= {278: (4, [rows_per_strip or len(rows)]), 273: (longs, at), 279: (longs, sizes)}
    mine |= tags
    return {number: value for number, value in mine.items() if value is not None}


def place(west, north, step, keys=GEO_4326):
    return {33550: (12, [step, step, 0.0]), 33922: (12, [0.0, 0.0, 0.0, west, north, 0.0]), 34735: (3, keys)}


def tiff(rows, kind="i2", compress=1, tile=None, rows_per_strip=8, bands=1, sparse=(), big=False, endian="<", at=None,
         tags=None, overviews=(), next_is=None):
    """The bytes. `tags`: what replaces the right tags ({number: (type, values) or None}); overviews: their rows."""
    out = Tiff(big, endian)
    where = at if at is not None else place(8.0, 47.0, 1 / 1200)
    out.directory(image(out, rows, kind, compress, tile, rows_per_strip, bands, set(sparse), where | (tags or {})),
                  next_is if not overviews else None)
    for i, small in enumerate(overviews):
        out.directory(image(out, small, kind, compress, tile, rows_per_strip, bands, set(), {254: (4, [1])}),
                      next_is if i == len(overviews) - 1 else None)
    return bytes(out.data)
