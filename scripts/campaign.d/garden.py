"""The mini garden: other servers in front of the daemon, and requests on whose end two programs might not agree."""
import concurrent.futures
import re
import time

from common import peers
from common.daemon import Daemon, Wire

TIERS = ("gate", "campaign")
ASKED = "B3: 0 requests seen by the daemon that the front end did not send; 200,000 payloads for each of ten front ends"
WHY_NOT = "the count of payloads grows with each campaign"
CLIENTS = 48
QUIET_S = 0.25

LENGTHS = ["5", "0", "{n}", "{n}", "+{n}", "{n}, {n}", " {n} ", "0{n}", "-1", "0x{n}", "{n};a", "", "\x0b{n}", "{n}\x00", "1e1", "{n} 0"]
CODINGS = ["chunked", "Chunked", "xchunked", "identity", "gzip, chunked", "chunked, gzip", "chunked;a=b", "\x0bchunked", "chunked\x00", "", ",chunked",
           "\"chunked\"", "chunked ", "\tchunked", "chunk\xe9d", "chunked, identity", "trailers"]
NAMES = {"length": ["Content-Length", "content-length", "Content-Length ", "Content_Length", "\tContent-Length", "Content-Length\x00", "Content-\xe9Length"],
         "coding": ["Transfer-Encoding", "transfer-encoding", "Transfer-Encoding ", "Transfer_Encoding", " Transfer-Encoding", "Transfer-Encoding\x0b", "X: y\nTransfer-Encoding", "X: y\rTransfer-Encoding"]}
METHODS = ["GET", "POST", "HEAD", "OPTIONS", "PUT", "POST", "GET"]
TARGETS = ["/livez?{m}", "/livez?{m}", "http://test/livez?{m}", "/livez?{m}%20HTTP/1.1%0d%0a", "/livez?{m} HTTP/1.1\r\nX: y", "/livez?{m}\tHTTP/1.1", "/./livez?{m}", "/livez;?{m}"]
VERSIONS = ["HTTP/1.1"] * 6 + ["HTTP/1.0", "HTTP/1.2", "HTTP/2.0", "HTTP/1.1 ", "http/1.1"]
ENDS = ["\r\n"] * 12 + ["\n", "\r", "\r\r\n", "\n\r"]
OTHERS = ["Connection: close", "Connection: keep-alive, Content-Length", "Connection: Transfer-Encoding", "Expect: 100-continue", "Upgrade: h2c", "X: " + "y" * 4000, "Host: b", "X:\r\n folded", "TE: trailers", "X-A : b"]


def payload(rng, number):
    """Two or three requests with markers {number}.0 .. and one {number}.inner that lies in a body."""
    data = ""
    for k in range(rng.randrange(2, 4)):
        inner = f"GET /livez?m{number}.inner{k} HTTP/1.1\r\nHost: test\r\n\r\n"
        chunked = rng.choice((f"{len(inner):x}\r\n{inner}\r\n0\r\n\r\n", "0\r\n\r\n" + inner, f"0{len(inner):x};a=b\r\n{inner}\r\n0\r\nX: y\r\n\r\n",
                              f"{len(inner):x}\n{inner}\n0\n\n", f"+{len(inner):x}\r\n{inner}\r\n0\r\n\r\n", f"0x{len(inner):x}\r\n{inner}\r\n0\r\n\r\n"))
        fields, body = ["Host: test"], ""
        framing = rng.randrange(5)
        if framing in (1, 3):
            body = inner
            fields.append(f"{rng.choice(NAMES['length'])}: " + rng.choice(LENGTHS).replace("{n}", str(len(inner))))
        if framing in (2, 3, 4):
            body = chunked
            fields.append(f"{rng.choice(NAMES['coding'])}: {rng.choice(CODINGS)}")
        if framing == 4:
            fields.append(f"{rng.choice(NAMES['length'])}: " + rng.choice(LENGTHS).replace("{n}", str(len(chunked))))
        if rng.random() < 0.3:
            fields.append(rng.choice(OTHERS))
        rng.shuffle(fields)
        end = rng.choice(ENDS)
        head = f"{rng.choice(METHODS)} {rng.choice(TARGETS).replace('{m}', f'm{number}.{k}')} {rng.choice(VERSIONS)}"
        data += head + end + "".join(f + (end if rng.random() < 0.9 else "\r\n") for f in fields) + end + body
    return data.encode("latin1")


def answers(port, data):
    """How many responses the front end gives."""
    got = b""
    try:
        with Wire(port, 5) as wire:
            wire.send(data)
            wire.socket.settimeout(QUIET_S)
            while True:
                more = wire.socket.recv(65536)
                if not more:
                    break
                got += more
    except OSError:
        pass
    return len(re.findall(rb"HTTP/1\.[01] (?!100)\d\d\d", got))


def through(run, name, start, most, seconds):
    """As many payloads as the time allows, a thousand at a time."""
    end, payloads, given = time.monotonic() + seconds, [], []
    with Daemon("--access-log", "--max-connections-per-address", "4096") as daemon, start(run.work, daemon.port) as front, \
            concurrent.futures.ThreadPoolExecutor(CLIENTS) as pool:
        while len(payloads) < most and (not payloads or time.monotonic() < end):
            some = [payload(run.rng, len(payloads) + i) for i in range(min(1000, most - len(payloads)))]
            given += pool.map(lambda data: answers(front.port, data), some)
            payloads += some
        time.sleep(0.5)
        code = daemon.stop()
        log = "".join(daemon.log)
    run.executions += len(payloads)
    if code != 0:
        run.fail(f"{name}: the daemon ended with {code}")
    seen = {}
    for number, rest in re.findall(r"livez;?\?m(\d+)\.(\w+)", log):
        seen.setdefault(int(number), []).append(rest)
    smuggled = [i for i, marks in seen.items() if len(marks) > given[i]]
    for i in smuggled[:5]:
        run.fail(f"{name}: the daemon saw {seen[i]}, the front end answered {given[i]} times: {payloads[i]!r}")
    run.note(f"{name} {len(payloads):,} payloads, {sum(map(len, seen.values())):,} requests came through, {len(smuggled)} smuggled")


def run(run):
    fronts = list(peers.FRONTS.items())
    for i, (name, start) in enumerate(fronts):
        through(run, name, start, 2000 if run.tier == "gate" else 200_000, run.time_left() / (len(fronts) - i))
