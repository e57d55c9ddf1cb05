"""testdata/http_probes.txt: (name, clause, status, bytes)."""
import re

from .programme import ROOT

SIMPLE = {"r": b"\r", "n": b"\n", "t": b"\t", "\\": b"\\"}


def unescape(text):
    """The bytes, and what is left of the text behind them."""
    data = b""
    while text and text[0] != "}":
        if text[0] != "\\":
            data, text = data + text[0].encode("latin1"), text[1:]
        elif text[1] == "x":
            data, text = data + bytes([int(text[2:4], 16)]), text[4:]
        elif text[1] == "{":
            times, rest = re.match(r"\\\{(\d+):(.*)", text, re.S).groups()
            unit, rest = unescape(rest)
            data, text = data + unit * int(times), rest[1:]
        else:
            data, text = data + SIMPLE[text[1]], text[2:]
    return data, text


def table():
    found = []
    for line in (ROOT / "testdata/http_probes.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            name, clause, status, data = line.split("\t")
            found.append((name, clause, int(status), unescape(data)[0]))
    return found
