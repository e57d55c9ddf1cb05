"""A soak: tiles warm and cold, heights, reloads, for as long as one gives it: memory and descriptors stay flat."""
import itertools
import random
import signal
import statistics
import subprocess
import threading
import time

from common import programme
from common.daemon import DEM, Daemon, Wire, held
from common.figures import numbers

TIERS = ("gate", "campaign")
SECONDS = {"gate": 3600}  # where --seconds says nothing; less is too short for a verdict in MB an hour
ASKED = "F6: two hours at 70 % load with reloads; memory grows by less than 1 MB an hour once warm, descriptors do not, no 5xx"
WHY_NOT = ("an hour at the gate, else as long as --seconds says; in a run of less than an hour 4 MB are allowed in its last half, and one step is no "
           "growth; reloads, but no faults")
EVERY_S = 5  # a look, and now and then a reload
NOISE_MB = 4  # in a short run


class Asks(threading.Thread):
    """Ten requests a second, whatever comes."""

    def __init__(self, port, seed, kinds):
        super().__init__(daemon=True)
        self.port, self.rng, self.kinds, self.ended, self.sent, self.wrong = port, random.Random(seed), kinds, False, 0, []
        self.start()

    def run(self):
        wire = None
        while not self.ended:
            path = self.rng.choice(self.kinds)(self.rng)
            self.sent += 1
            try:
                wire = wire or Wire(self.port, 60)
            except OSError as error:
                self.wrong.append(f"{path}: {error}")
                break
            wire.send(f"GET {path} HTTP/1.1\r\nHost: t\r\n\r\n".encode())  # what comes of it, the answer says
            got = wire.reply()
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


def REACHED(rows):
    longest = max(rows, key=lambda row: int(row.seconds))
    grown = numbers(r"([+-][\d.]+) MB (?:an hour )?in (?:the last )?(\d+) minutes", [longest])
    said = f"{grown[0][0]:+.2f} MB in its last {grown[0][1]} minutes" + (" (an hour)" if "MB an hour" in longest.result else "") if grown else "no figure of memory"
    return {"F6": f"the longest: {int(longest.seconds) / 60:.0f} minutes, {longest.tried:,} requests, {longest.wrong} wrong, {said}; "
                  f"{sum(row.tried for row in rows):,} requests in {len(rows)} rows"}


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
            looks.append((time.monotonic(), *held(daemon.process.pid)))
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


def slope(points):
    """MB an hour: the median of the slopes between any two of some hundred points (Theil and Sen), of which a fifth may be outliers."""
    points = points[::max(1, len(points) // 200)]
    return statistics.median((b[1] - a[1]) / 1024 / (b[0] - a[0]) * 3600 for a, b in itertools.combinations(points, 2))


def judge(run, looks, reloads):
    """The last half, in which it is warm: of the daemon and those that read its DEMs. What leaks grows in both quarters of
    it; one step, of a program that was begun anew, does not."""
    late = looks[len(looks) // 2:]
    if len(late) < 4:
        run.note("too short for a verdict on memory")
        return
    before, after = late[:len(late) // 2], late[len(late) // 2:]
    hours = (late[-1][0] - late[0][0]) / 3600
    of_all, *of_quarters = slope(late), slope(before), slope(after)
    files = statistics.median(n for _, _, n in after) - statistics.median(n for _, _, n in before)
    run.note(f"{reloads} reloads; {late[-1][1] / 1024:.0f} MB with its children, {of_all:+.2f} MB an hour in the last {hours * 60:.0f} minutes "
             f"({', '.join(f'{one:+.2f}' for one in of_quarters)} in each half of these); {late[-1][2]} descriptors, {files:+.0f}")
    short = looks[-1][0] - looks[0][0] < 0.95 * 3600
    if min(of_all, *of_quarters) > 1 and (not short or of_all * hours > NOISE_MB):
        run.fail(f"memory grew by {of_all:.1f} MB an hour in the last {hours * 60:.0f} minutes")
    if files > 5:
        run.fail(f"descriptors grew by {files:.0f} in the last half")
