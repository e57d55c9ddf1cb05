"""Reloads and ends of the daemon under load: no request that was sent on an open connection is lost."""
import signal
import threading
import time

from common.daemon import DEM, Daemon, Wire
from common.programme import ROOT

TIERS = ("ci", "gate", "campaign")
ASKED = "F5: 200 ends and 200 reloads (half of them of a broken file) under load: 0 failed requests, the old configuration kept"
WHY_NOT = "no hand-over of the port between two daemons: new connections are refused between them"


class Client(threading.Thread):
    """Asks all the time; opens a connection anew where it is told that this one ends."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.port, self.ended, self.sent, self.lost, self.wrong = port, False, 0, 0, []
        self.start()

    def run(self):
        wire = None
        while not self.ended:
            if wire is None:
                try:
                    wire = Wire(self.port, 30)
                except OSError:
                    return
            wire.send(b"GET /terrain/a/0/0/0.terrain HTTP/1.1\r\nHost: t\r\n\r\n")
            self.sent += 1
            got = wire.reply()
            if got is None:
                self.lost += 1
                return
            if got[0] not in (200, 503):
                self.wrong.append(got[0])
            if got[1].get("connection") == "close":
                wire.close()
                wire = None
            time.sleep(0.002)


def config(path, whole):
    path.with_suffix(".new").write_text(f'[[dataset]]\nname = "a"\nfiles = ["{DEM}"]\n\n[[dataset]]\nname = "b"\nfiles = ["{ROOT}/testdata/{whole}"]\n')
    path.with_suffix(".new").rename(path)


def joined(run, clients, what):
    for client in clients:
        client.ended = True
    for client in clients:
        client.join(60)
    run.executions += sum(c.sent for c in clients)
    lost = sum(c.lost for c in clients)
    wrong = [w for c in clients for w in c.wrong]
    if lost or wrong:
        run.fail(f"{what}: {lost} requests lost, {wrong[:5]} answered")


def reloads(run, count):
    path = run.work / "tind.toml"
    config(path, "bigtujunga_crop.tif")
    with Daemon("--config", path, dems=()) as daemon:
        clients = [Client(daemon.port) for _ in range(6)]
        for i in range(count):
            config(path, ("none.tif", "bigtujunga_crop.tif", "desert.asc")[i % 3])
            known = sum("reload" in line for line in daemon.log)
            daemon.process.send_signal(signal.SIGHUP)
            for _ in range(1000):
                if sum("reload" in line for line in daemon.log) > known:
                    break
                time.sleep(0.02)
            else:
                run.fail(f"reload {i}: nothing in the log")
                break
        joined(run, clients, "reloads")
        code = daemon.stop()
        if code != 0:
            run.fail(f"reloads: ended with {code}")
    run.note(f"{count} reloads")


def ends(run, count):
    done = 0
    for _ in range(count):
        if run.time_left() < 0:
            break
        with Daemon(dems=(f"a={DEM}",)) as daemon:
            clients = [Client(daemon.port) for _ in range(4)]
            time.sleep(run.rng.uniform(0.05, 0.5))
            daemon.process.send_signal(signal.SIGTERM)
            code = daemon.process.wait(60)  # a second signal would end it at once
            if code != 0:
                run.fail(f"end: {code}")
        joined(run, clients, "end")
        done += 1
    run.note(f"{done} ends")


def run(run):
    reloads(run, 6 if run.tier == "ci" else 200)
    ends(run, 4 if run.tier == "ci" else 200)
