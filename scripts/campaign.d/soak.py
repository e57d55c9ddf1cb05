"""A soak: tiles warm and cold, heights, reloads, for as long as one gives it: memory and descriptors stay flat."""
import os
import random
import signal
import statistics
import subprocess
import threading
import time

from common import programme
from common.daemon import DEM, Daemon, Wire, rss_kb

TIERS = ("gate", "campaign")
ASKED = "F6: two hours at 70 % load with reloads; memory grows by less than 1 MB an hour once warm, descriptors do not, no 5xx"
WHY_NOT = "as long as --seconds says (the gate: 15 minutes); growth is judged by the last half, in which 4 MB are allowed"
EVERY_S = 5  # a look, and now and then a reload


class Asks(threading.Thread):
    """Ten requests a second, whatever comes."""

    def __init__(self, port, seed, kinds):
        super().__init__(daemon=True)
        self.port, self.rng, self.kinds, self.ended, self.sent, self.wrong = port, random.Random(seed), kinds, False, 0, []
        self.start()

    def run(self):
        wire = None
        while not self.ended:
            wire = wire or Wire(self.port, 60)
            path = self.rng.choice(self.kinds)(self.rng)
            wire.send(f"GET {path} HTTP/1.1\r\nHost: t\r\n\r\n".encode())
            got = wire.reply()
            self.sent += 1
            if got is None or got[0] not in (200, 404):
                self.wrong.append(f"{path}: {got and got[0]}")
            if got is None or got[1].get("connection") == "close":
                wire.close()
                wire = None
            time.sleep(self.rng.expovariate(10))


def any_tile(rng):
    level = rng.randrange(6, 14)
    side = 180 / 2**level
    lon, lat = rng.uniform(-122, -121.4), rng.uniform(46.5, 47.1)
    return f"/terrain/rainier/{level}/{int((lon + 180) / side)}/{int((lat + 90) / side)}.terrain"


def height(rng):
    return f"/v1/rainier?locations={rng.uniform(46.61, 46.99)},{rng.uniform(-121.97, -121.51)}"


def wrong_path(rng):
    return f"/none/{rng.randrange(10**9)}"


def run(run):
    programme.needs("h2load")
    # A small cache, so that tiles are made all the time.
    with Daemon("--cache-mb", "4", "--source-cache-mb", "4", "rainier=" + str(DEM), dems=()) as daemon:
        load = subprocess.Popen(["h2load", "--h1", "-c", "20", "--rps", "50", "-D", str(int(run.seconds)), "--log-file", run.work / "load",
                                 f"http://127.0.0.1:{daemon.port}/terrain/rainier/0/0/0.terrain"], stdout=subprocess.DEVNULL)
        asks = [Asks(daemon.port, run.seed * 100 + i, (any_tile, any_tile, any_tile, height, wrong_path)) for i in range(8)]
        looks, reloads = [], 0
        while run.time_left() > 0 and daemon.process.poll() is None:
            time.sleep(min(EVERY_S, max(0.1, run.time_left())))
            pid = daemon.process.pid
            looks.append((time.monotonic(), rss_kb(pid), len(os.listdir(f"/proc/{pid}/fd"))))
            if run.rng.random() < 0.2:
                daemon.process.send_signal(signal.SIGHUP)
                reloads += 1
        for ask in asks:
            ask.ended = True
        for ask in asks:
            ask.join(60)
        load.wait(60)
        if daemon.process.poll() is not None:
            run.fail(f"the daemon ended with {daemon.process.returncode}")
            return
        code = daemon.stop()
        if code != 0:
            run.fail(f"the daemon ended with {code}")
    rows = [line.split()[1] for line in (run.work / "load").read_text().splitlines()]
    bad = sum(status != "200" for status in rows)
    run.executions += len(rows) + sum(a.sent for a in asks)
    wrong = [w for a in asks for w in a.wrong]
    if bad or wrong:
        run.fail(f"{bad} warm tiles and {len(wrong)} other requests were not answered: {wrong[:5]}")
    judge(run, looks, reloads)


def judge(run, looks, reloads):
    """The middle of the third quarter beside that of the fourth."""
    late = looks[len(looks) // 2:]
    if len(late) < 4:
        run.note("too short for a verdict on memory")
        return
    before, after = late[:len(late) // 2], late[len(late) // 2:]
    grown = (statistics.median(k for _, k, _ in after) - statistics.median(k for _, k, _ in before)) / 1024
    hours = (after[len(after) // 2][0] - before[len(before) // 2][0]) / 3600
    files = statistics.median(n for _, _, n in after) - statistics.median(n for _, _, n in before)
    run.note(f"{reloads} reloads; {late[-1][1] / 1024:.0f} MB, {grown:+.2f} MB in {hours * 60:.0f} minutes at the end; {late[-1][2]} descriptors, {files:+.0f}")
    if grown > 4:
        run.fail(f"memory grew by {grown:.1f} MB in the last half")
    if files > 5:
        run.fail(f"descriptors grew by {files:.0f} in the last half")
