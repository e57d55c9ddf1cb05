"""Reloads and ends of the daemon under load: no request that was sent on an open connection is lost."""
import itertools
import random
import signal
import socket
import subprocess
import threading
import time
import urllib.error
import urllib.request

from common.daemon import DEM, Daemon, Wire
from common.figures import numbers
from common.programme import ROOT

TIERS = ("ci", "gate", "campaign")
ASKED = "F5: 200 ends and 200 reloads (half of them of a broken file) under load: 0 failed requests, drained within 5 s, the old configuration kept"
WHY_NOT = ("50 ends more are of daemons that bind the port anew, as without a service manager: connections are refused until the next one listens, "
           "and the row says how many")
DRAIN_S = 5  # asked; --drain-delay, which would come on top, is 0, and nothing that is asked here takes long


class Client(threading.Thread):
    """Asks all the time: for a tile that is there, now and then for one that is to be made, and for heights. Opens a connection
    anew where it is told that this one ends."""

    def __init__(self, port, seed):
        super().__init__(daemon=True)
        self.port, self.rng, self.ended = port, random.Random(seed), False
        self.sent = self.answered = self.refused = self.busy = self.lost = 0
        self.wrong = []
        self.start()

    def path(self):
        lon, lat = self.rng.uniform(-121.97, -121.51), self.rng.uniform(46.61, 46.99)
        level = self.rng.randrange(6, 12)
        side = 180 / 2**level
        return self.rng.choices(("/terrain/a/0/0/0.terrain", f"/terrain/a/{level}/{int((lon + 180) / side)}/{int((lat + 90) / side)}.terrain",
                                 f"/elevation/a?lon={lon:.5f}&lat={lat:.5f}"), (8, 1, 1))[0]

    def run(self):
        wire = None
        while not self.ended:
            try:
                # From another address: a socket that tries a port where nobody listens may else be connected with itself.
                wire = wire or Wire(self.port, 30, source="127.0.0.2")
            except OSError:
                self.refused += 1
                time.sleep(0.01)
                continue
            wire.send(f"GET {self.path()} HTTP/1.1\r\nHost: t\r\n\r\n".encode())  # what comes of it, the answer says
            self.sent += 1
            got = wire.reply()
            if got is None:
                self.lost += 1
            elif got[0] == 200:
                self.answered += 1
            elif got[0] == 503:
                self.busy += 1
            else:
                self.wrong.append(got[0])
            if got is None or got[1].get("connection") == "close":
                wire = wire.close()
            time.sleep(0.002)


def joined(run, clients, what, may_refuse=False):
    """How many connections were refused."""
    for client in clients:
        client.ended = True
    for client in clients:
        client.join(60)
    run.executions += sum(c.sent for c in clients)
    lost, busy, refused = (sum(getattr(c, which) for c in clients) for which in ("lost", "busy", "refused"))
    wrong = [w for c in clients for w in c.wrong]
    if lost or busy or wrong or (refused and not may_refuse):
        run.fail(f"{what}: {lost} requests lost, {busy} answered with 503, {len(wrong)} with {wrong[:5]}, {refused} connections refused")
    if any(c.is_alive() for c in clients):
        run.fail(f"{what}: a client waits for an answer for ever")
    if clients and not any(c.answered for c in clients):
        run.fail(f"{what}: nothing was answered")
    return refused


def dataset(name, file):
    return f'[[dataset]]\nname = "{name}"\nfiles = ["{file}"]\n\n'


WHOLE = ("bigtujunga_crop.tif", "desert.asc")  # what b is of, in turn
# Behind an a as it was and a new c, without b.
BROKEN = (dataset("d", ROOT / "testdata/none.tif"), dataset("d", ROOT / "testdata/boundary.geojson"), '[[dataset]]\nname = "d\n',
          dataset("d", DEM) + "no_such_setting = 1\n")


def write(path, text):
    path.with_suffix(".new").write_text(text)
    path.with_suffix(".new").rename(path)


def state(daemon, name):
    """The ETag of what only one configuration serves, or the status."""
    for _ in range(200):
        try:
            with urllib.request.urlopen(f"{daemon.url}terrain/{name}/0/0/0.terrain", timeout=60) as reply:
                return reply.headers["ETag"]
        except urllib.error.HTTPError as error:
            if error.code != 503:  # else it has just been opened
                return error.code
        time.sleep(0.02)
    return 503


def reloaded(daemon, result):
    """Whether one reload more ends so, within 20 s."""
    counted = f'result="{result}"'
    before, all_before = daemon.metric("tind_reloads_total", counted), daemon.metric("tind_reloads_total")
    daemon.process.send_signal(signal.SIGHUP)
    for _ in range(1000):
        if daemon.metric("tind_reloads_total") > all_before:
            break
        time.sleep(0.02)
    return daemon.metric("tind_reloads_total", counted) == before + 1


def reloads(run, count):
    """A whole file and a broken one in turn; after the broken one all is as the whole one before said."""
    path, done, etags = run.work / "tind.toml", 0, {}
    write(path, dataset("a", DEM) + dataset("b", ROOT / "testdata" / WHOLE[0]))
    with Daemon("--config", path, dems=()) as daemon:
        if daemon.url is None:
            return run.fail(f"reloads: the daemon does not start: {''.join(daemon.log[-3:])}")
        etags[WHOLE[0]] = state(daemon, "b")
        clients = [Client(daemon.port, f"{run.seed} {i}") for i in range(6)]
        wholes, brokens, b = itertools.cycle(WHOLE[1:] + WHOLE[:1]), itertools.cycle(BROKEN), WHOLE[0]
        while done < count and run.time_left() > run.seconds / 2:
            if done % 2 == 0:
                write(path, dataset("a", DEM) + dataset("c", DEM) + next(brokens))
                good = reloaded(daemon, "failed")
            else:
                b = next(wholes)
                write(path, dataset("a", DEM) + dataset("b", ROOT / "testdata" / b))
                good = reloaded(daemon, "ok")
            done += 1
            got = state(daemon, "b"), state(daemon, "c")
            if not good or got != (etags.setdefault(b, got[0]), 404) or not isinstance(got[0], str):
                run.fail(f"reload {done} of {'a whole' if done % 2 == 0 else 'a broken'} file: {'' if good else 'does not end as it must, '}"
                         f"b is {got[0]}, {etags[b]} before, c is {got[1]}: {''.join(daemon.log[-3:])}")
                break
        if len(set(etags.values())) != len(etags):
            run.fail(f"reloads: all files look alike: {etags}")
        joined(run, clients, "reloads")
        code = daemon.stop()
        if code != 0:
            run.fail(f"reloads: ended with {code}")
    run.note(f"{done} of {count} reloads, {(done + 1) // 2} of a broken file")


def free_port(rng):
    """One that no client of anybody is given in the time when nobody listens there."""
    while True:
        port = rng.randrange(20000, 32000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                pass


def end(run, daemon):
    """Seconds that it takes; nothing where it does not."""
    begin = time.monotonic()
    daemon.process.send_signal(signal.SIGTERM)
    try:
        code = daemon.process.wait(60)  # a second signal would end it at once
    except subprocess.TimeoutExpired:
        run.fail("end: not within a minute")
        return None
    took = time.monotonic() - begin
    if code != 0:
        run.fail(f"end: {code}: {''.join(daemon.log[-3:])}")
    if took > DRAIN_S:
        run.fail(f"end: takes {took:.1f} s")
    return took


def ends(run, count, kept=None):
    """One daemon after the other at a port, and clients who go on asking there. `kept`: a socket at which they all listen,
    as systemd keeps one: then nobody is refused."""
    port = kept.getsockname()[1] if kept else free_port(run.rng)
    what, clients, took = "ends with a kept socket" if kept else "ends", [], []
    while len(took) < count and run.time_left() > 0:
        with Daemon(dems=(f"a={DEM}",), port=0 if kept else port, kept=kept) as daemon:
            if daemon.port != port:
                run.fail(f"{what}: the next daemon does not start: {''.join(daemon.log[-3:])}")
                break
            clients = clients or [Client(port, f"{run.seed} {i}") for i in range(4)]
            time.sleep(run.rng.uniform(0.1, 0.5))
            took.append(end(run, daemon))
            if took[-1] is None:
                break
    for client in clients:
        client.ended = True
    if kept and clients and not run.wrong:  # who waits still is served by one more
        with Daemon(dems=(f"a={DEM}",), kept=kept):
            refused = joined(run, clients, what)
    else:
        refused = joined(run, clients, what, may_refuse=not kept)
    slowest = max((t for t in took if t is not None), default=0)
    run.note(f"{len(took)} of {count} {what}, drained within {slowest:.1f} s; {refused:,} connections refused between two daemons")


def REACHED(rows):
    done, ended = numbers(r"(\d+)(?: of \d+)? reloads", rows), numbers(r"(\d+)(?: of \d+)? ends", rows)
    said = [f"{sum(n for n, in done):,} reloads and {sum(n for n, in ended):,} ends in {len(rows)} rows, {sum(row.tried for row in rows):,} requests; "
            f"{sum(row.wrong for row in rows)} wrong"]
    kept = numbers(r"(\d+) of \d+ ends with a kept socket, drained within [\d.]+ s; ([\d,]+) connections refused", rows)
    if kept:
        said.append(f"{sum(n for n, _ in kept):,} of the ends with the port handed over, {sum(n for _, n in kept):,} connections refused there")
    if drained := numbers(r"drained within ([\d.]+) s", rows):
        said.append(f"drained within {max(n for n, in drained)} s")
    return {"F5": "; ".join(said)}


def run(run):
    ci = run.tier == "ci"
    reloads(run, 6 if ci else 200)
    with socket.create_server(("127.0.0.1", 0), backlog=4096) as kept:
        ends(run, 4 if ci else 200, kept)
    ends(run, 2 if ci else 50)
