"""The mini garden: other servers in front of the daemon, and requests on whose end two programs might not agree."""
import concurrent.futures
import hashlib
import re
import time

from common import peers
from common.daemon import DEM, Daemon, Wire
from common.figures import numbers, span

TIERS = ("gate", "campaign")
ASKED = "B3: 0 requests seen by the daemon that the front end did not send; 200,000 payloads for each of ten front ends"
WHY_NOT = "2,000 payloads for each at the gate, more as the seconds of a campaign allow; OPTIONS takes no key, and is only counted"
CLIENTS = 48
QUIET_S, PATIENT_S = 0.25, 5
FIRST = 1_000_000  # of the numbers of payloads, which have as many digits when they are sent again
MOST_AGAIN = 50  # suspects of one front end
# Each front end adds it to what it sends: who comes without it is no request that it knows of. Without one they are only counted.
KEY = peers.KEY

LENGTHS = ["5", "0", "{n}", "{n}", "+{n}", "{n}, {n}", " {n} ", "0{n}", "-1", "0x{n}", "{n};a", "", "\x0b{n}", "{n}\x00", "1e1", "{n} 0"]
CODINGS = ["chunked", "Chunked", "xchunked", "identity", "gzip, chunked", "chunked, gzip", "chunked;a=b", "\x0bchunked", "chunked\x00", "", ",chunked",
           "\"chunked\"", "chunked ", "\tchunked", "chunk\xe9d", "chunked, identity", "trailers"]
NAMES = {"length": ["Content-Length", "content-length", "Content-Length ", "Content_Length", "\tContent-Length", "Content-Length\x00", "Content-\xe9Length"],
         "coding": ["Transfer-Encoding", "transfer-encoding", "Transfer-Encoding ", "Transfer_Encoding", " Transfer-Encoding", "Transfer-Encoding\x0b", "X: y\nTransfer-Encoding", "X: y\rTransfer-Encoding"]}
METHODS = ["GET", "POST", "HEAD", "OPTIONS", "PUT", "POST", "GET"]
TARGETS = ["/datasets?{m}", "/datasets?{m}", "http://test/datasets?{m}", "/datasets?{m}%20HTTP/1.1%0d%0a", "/datasets?{m} HTTP/1.1\r\nX: y", "/datasets?{m}\tHTTP/1.1", "/./datasets?{m}", "/datasets;?{m}"]
VERSIONS = ["HTTP/1.1"] * 6 + ["HTTP/1.0", "HTTP/1.2", "HTTP/2.0", "HTTP/1.1 ", "http/1.1"]
ENDS = ["\r\n"] * 12 + ["\n", "\r", "\r\r\n", "\n\r"]
OTHERS = ["Connection: close", "Connection: keep-alive, Content-Length", "Connection: Transfer-Encoding", "Expect: 100-continue", "Upgrade: h2c", "X: " + "y" * 4000, "Host: b", "X:\r\n folded", "TE: trailers", "X-A : b"]


def payload(rng, number):
    """Two or three requests with markers {number}.0 .. and one {number}.inner that lies in a body."""
    data = ""
    for k in range(rng.randrange(2, 4)):
        inner = f"GET /datasets?m{number}.inner{k} HTTP/1.1\r\nHost: test\r\n\r\n"
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


def daemon(run):
    """One that says in its log whether a request has the key. Who has none may ask once, and then gets 429: 401 would be for
    what there is to see alone. (OPTIONS it answers to everybody.)"""
    config, sha256 = run.work / "garden.toml", hashlib.sha256(KEY.encode()).hexdigest()
    keys = f'rate_per_address = 0.001\nburst_per_address = 1\n\n[[key]]\nname = "front"\nsha256 = "{sha256}"\nscopes = ["read"]\n'
    config.write_text((keys if KEY else "") + f'\n[[dataset]]\nname = "dem"\nfiles = ["{DEM}"]\n')
    made = Daemon("--config", config, "--access-log", "--max-connections-per-address", "4096", dems=())
    if made.url is None:
        raise RuntimeError(f"the daemon does not start: {''.join(made.log[-3:])}")
    if KEY and [status(made.port), status(made.port)] != [404, 429]:
        run.fail("the daemon does not tell who has the key")
    return made


def status(port, path="/none"):
    with Wire(port) as wire:
        wire.send(f"GET {path} HTTP/1.1\r\nHost: test\r\n\r\n".encode())
        got = wire.reply()
        return got and got[0]


def answers(port, data, quiet_s=QUIET_S):
    """How many of the daemon's responses the front end gives, until there is nothing new for so long. What it answers by
    itself would hide as many requests that it does not know of; the daemon's answers have a field that none of its own have."""
    got = b""
    try:
        with Wire(port, 5) as wire:
            wire.send(data)  # refused before its end was there: that is an answer, too
            wire.socket.settimeout(quiet_s)
            while True:
                more = wire.socket.recv(65536)
                if not more:
                    break
                got += more
    except OSError:
        pass
    heads = re.findall(rb"HTTP/1\.[01] (?!100)\d\d\d[^\r\n]*\r\n(?:[^\r\n]+\r\n)*", got)
    return sum(b"\r\naccess-control-allow-origin:" in head.lower() for head in heads)


def seen_by(served):
    """[(mark, status)] of each number."""
    seen = {}
    for number, mark, code in re.findall(r"datasets;?\?m(\d+)\.(\w+)\S* (\d{3}) ", "".join(served.log)):
        seen.setdefault(int(number), []).append((mark, int(code)))
    return seen


def without_key(marks):
    return any(code in (401, 429) for _, code in marks)


def looks_smuggled(marks, given):
    """A request without the key, or more of them than the front end has passed answers on."""
    return without_key(marks) or len(marks) > given


def is_smuggled(front, served, number, data):
    """Sent again alone, at a front end that has time: with little, an answer may come too late to be counted. Twice, for what
    depends on the connection that it was sent on."""
    for again in (number + FIRST, number + 2 * FIRST):
        given = answers(front.port, data.replace(b"m%d." % number, b"m%d." % again), PATIENT_S)
        time.sleep(0.5)
        if looks_smuggled(seen_by(served).get(again, []), given):
            return True
    return False


def through(run, name, start, most, seconds):
    """As many payloads as the time allows, a thousand at a time."""
    end, payloads, given = time.monotonic() + seconds, [], []
    with daemon(run) as served, start(run.work, served.port) as front, concurrent.futures.ThreadPoolExecutor(CLIENTS) as pool:
        if status(front.port, "/datasets") != 200:
            run.fail(f"{name} does not send requests on with its key")
            return
        while len(payloads) < most and (not payloads or time.monotonic() < end):
            some = [payload(run.rng, FIRST + len(payloads) + i) for i in range(min(1000, most - len(payloads)))]
            given += pool.map(lambda data: answers(front.port, data), some)
            payloads += some
        time.sleep(1)
        seen = seen_by(served)
        suspected = [number for number, marks in seen.items() if looks_smuggled(marks, given[number - FIRST])]
        suspected.sort(key=lambda number: not without_key(seen[number]))  # what busy machines alone can cause comes last
        smuggled = [number for number in suspected[:MOST_AGAIN] if is_smuggled(front, served, number, payloads[number - FIRST])]
        code = served.stop()
    run.executions += len(payloads)
    if code != 0:
        run.fail(f"{name}: the daemon ended with {code}")
    if any("lines of the log are missing" in line for line in served.log):
        run.fail(f"{name}: the log is not whole")
    for number in smuggled[:5]:
        i = number - FIRST
        run.fail(f"{name}: the daemon saw {seen[number]}, the front end passed {given[i]} answers on: {payloads[i]!r}")
    run.note(f"{name} {len(payloads):,} payloads, {sum(map(len, seen.values())):,} requests came through, {len(suspected)} suspected, "
             f"{len(smuggled)} confirmed{f' of {MOST_AGAIN}' if len(suspected) > MOST_AGAIN else ''}{'' if KEY else ' (counted only)'}")


def REACHED(rows):
    sent = {}
    for front, payloads in numbers(r"(\w+) ([\d,]+) payloads", rows):
        sent[front] = sent.get(front, 0) + payloads
    counted = [sum(n for n, in numbers(r"(\d+) (?:smuggled|confirmed)", [row])) for row in rows]
    more = f", {sum(counted)} in all" if any(counted) else ""
    return {"B3": f"{span(sent.values())} payloads for each of {len(sent)} front ends, {sum(sent.values()):,} in all; {counted[-1]} smuggled in the last row{more}"}


def run(run):
    fronts = list(peers.FRONTS.items())
    for i, (name, start) in enumerate(fronts):
        through(run, name, start, 2000 if run.tier == "gate" else 200_000, run.time_left() / (len(fronts) - i))
