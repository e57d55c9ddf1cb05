"""HTTP: the table of probes over sockets, whole, byte by byte and split; and other servers on the same table."""
import time

from common import figures, peers, probes, programme
from common.daemon import Daemon, Wire

TIERS = ("ci", "gate", "campaign")
ASKED = "B1, B2, B4: 250 probes by clause, whole, byte by byte, at every split (50,000 deliveries); 1,000,000 pipelined"
WHY_NOT = ("node, squid, trafficserver, nghttpx and caddy are not compared with; probes have no level of MUST or SHOULD; of the 355 that every server must refuse or take "
           "three get 400 from tind that the table lets pass ('a wild query', 'absolute form with only a query', 'a target of 4 KiB of query'): the parser takes them, "
           "and the page at / takes no query; a probe of 65,669 bytes is split at every 97th only")
BEHIND = b"GET /livez?behind HTTP/1.1\r\nHost: test\r\n\r\n"


def REACHED(rows):
    last, piped = figures.last_whole(rows), r"([\d,]+) pipelined"
    deliveries = [row.tried - figures.numbers(piped, [row])[0][0] for row in rows if "pipelined in" in row.result]
    compared = [row.result.split("taken as the table says: ")[1] for row in rows if "as the table says" in row.result]
    return {"B1": f"{len(probes.table())} probes, {last.wrong} wrong in the last row; of 355 that any server must refuse or take so did: {compared[-1] if compared else '-'}",
            "B2": f"{max(deliveries):,} deliveries over sockets in a row, {sum(deliveries):,} in all",
            "B4": f"{max(n for n, in figures.numbers(piped, rows)):,} in a row, {sum(n for n, in figures.numbers(piped, rows)):,} in all; {last.wrong} wrong in the last row"}


def deliver(wire, data, pieces):
    at = 0
    for end in [*pieces, len(data)]:
        wire.send(data[at:end])
        at = end


def verdict(port, data, pieces=()):
    """What becomes of it: its status, whether that ends the connection, how many answers come for what is sent behind."""
    with Wire(port) as wire:
        deliver(wire, data + BEHIND, pieces)
        first = wire.reply()
        if first is None:
            return 0, True, 0
        more = 0
        ends = first[1].get("connection") == "close"
        if first[0] >= 400 and ends:
            while wire.reply():
                more += 1
        return first[0], ends, more


def wrong(probe, got):
    name, clause, status, _ = probe
    if status >= 400:
        right = got == (status, True, 0)
    else:  # the parser takes it: a resource that wants no query, or another range, says so and goes on
        right = 200 <= got[0] < 400 or got[0] in (400, 404, 416) and not got[1]
    return [] if right else [f"{name} ({clause}): {got[0]} and {got[2]} answers behind it, not {status}"]


def table(run, daemon):
    for probe in run.sample(probes.table(), 1):
        data = probe[3]
        ways = [(), tuple(range(1, len(data)))] if len(data) < 1000 else [()]
        splits = range(1, len(data), 1 if len(data) < 10_000 else 97)
        if run.tier == "ci":
            splits = run.rng.sample(list(splits), min(3, len(splits)))
        for pieces in [*ways, *((at,) for at in splits)]:
            run.executions += 1
            for what in wrong(probe, verdict(daemon.port, data, pieces)):
                run.fail(f"{what} (in {len(pieces) + 1} pieces)")
        if daemon.process.poll() is not None:
            run.fail(f"the daemon ended with {daemon.process.returncode} at {probe[0]}")
            return


def pipelined(run, daemon, count):
    """In order, all of them; and nothing behind one that is not valid."""
    done, begin = 0, time.monotonic()
    while done < count and run.time_left() > 0:
        bad_at = run.rng.randrange(500, 1000)
        kinds = [run.rng.choice((b"GET /livez?%d", b"HEAD /livez?%d", b"GET /none/%d", b"OPTIONS /livez?%d")) for _ in range(bad_at)]
        data = b"".join(kind % i + b" HTTP/1.1\r\nHost: test\r\n\r\n" for i, kind in enumerate(kinds))
        with Wire(daemon.port) as wire:
            wire.send(data + b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n" + BEHIND * 20)
            for i, kind in enumerate(kinds):
                got = wire.reply(kind.startswith(b"HEAD"))
                want = 404 if b"none" in kind else 204 if kind.startswith(b"OPTIONS") else 200
                if got is None or got[0] != want or want == 404 and f"/none/{i}".encode() not in got[2]:
                    run.fail(f"pipelined: request {i} of {bad_at} got {got and got[0]}, not {want}")
                    return
            refused = wire.reply()
            if not refused or refused[0] != 400 or wire.reply():
                run.fail("pipelined: something was answered behind a request that is not valid")
        done += bad_at
        run.executions += bad_at
    run.note(f"{done:,} pipelined in {time.monotonic() - begin:.0f} s")


def compare(run):
    """The same table against others: how many of the probes that every server must refuse, or take, are so."""
    rules = [p for p in probes.table() if p[2] in (200, 400)]
    figures = []
    for name, start in peers.SERVERS.items():
        with start(run.work) as peer:
            right = sum(judged(peer.port, probe) for probe in rules)
            figures.append(f"{name} {right}")
    with Daemon() as daemon:
        right = sum(judged(daemon.port, probe) for probe in rules)
    run.note(f"of {len(rules)} probes refused or taken as the table says: tind {right}, " + ", ".join(figures))


def judged(port, probe):
    data, refused = probe[3], probe[2] >= 400
    try:
        with Wire(port, 3) as wire:
            wire.send(data)
            got = wire.reply()
    except OSError:
        got = None
    taken = got is not None and got[0] < 400
    return taken != refused if got is not None else refused


def run(run):
    with Daemon() as daemon:
        table(run, daemon)
        pipelined(run, daemon, 20000 if run.tier == "ci" else 1000000)
        code = daemon.stop()
        if code != 0:
            run.fail(f"the daemon ended with {code}")
    if run.tier != "ci":
        programme.needs("nginx", "haproxy", "h2o")
        compare(run)
