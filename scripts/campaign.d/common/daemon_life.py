"""A daemon's life, from its start through tiles, a job and a reload to its end, and whether it was an honest one."""
import os
import shutil
import signal
import subprocess
import urllib.error
import urllib.request

from .daemon import Daemon
from .hostile import HONEST
from .tiff import tiff
from .work import heights

PATHS = ["/terrain/dem/layer.json", "/terrain/dem/0/1/0.terrain", "/terrain/dem/5/33/24.terrain", "/terrain/dem/5/33/24.terrain", "/elevation/dem?lon=8.02&lat=46.98",
         "/datasets", "/terrain/built/layer.json", "/terrain/built/0/1/0.terrain", "/livez"]
OTHERWISE = (5, 8, "job")  # times and identifiers are in them
JOB = b'{"inputs": {"dataset": "dem", "max_error": 50}}'


def ask(daemon, path, data=None):
    """(status, body), or (0, why)."""
    try:
        request = urllib.request.Request(daemon.url + path.lstrip("/"), data=data, headers={"Content-Type": "application/json"} if data else {})
        with urllib.request.urlopen(request, timeout=120) as reply:
            return reply.status, reply.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()
    except OSError as error:
        return 0, str(error)


class DaemonLife:
    """Of one DEM and one built folder, which is taken away from where the works made it."""

    def __init__(self, run):
        self.folder, self.dem, self.built = run.work / "daemon", run.work / "dem.tif", run.work / "built"
        self.dem.write_bytes(tiff(heights(), compress=8))
        (run.work / "build-wanted/out").rename(self.built)

    def live(self, prefix=(), env=None):
        """(answers by path, exit code, log). `prefix` is a command that has the daemon for its only child."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()
        daemon = Daemon("--threads", "1", "--build-threads", "1", "--cache-mb", "4", "--jobs-dir", self.folder / "jobs", dems=(self.dem, self.built),
                        prefix=prefix, env=env and {**os.environ, **env})

        def tell(sign):
            try:
                pid = daemon.process.pid
                if prefix:
                    with open(f"/proc/{pid}/task/{pid}/children") as children:
                        pid = int(children.read().split()[0])
                os.kill(pid, sign)
            except (OSError, IndexError):
                pass  # it has ended

        answers = {}
        if daemon.url:
            for i, path in enumerate(PATHS):
                answers[i] = ask(daemon, path)
            answers["job"] = ask(daemon, "/processes/simplify/execution", JOB)
            tell(signal.SIGHUP)
            answers["last"] = ask(daemon, "/terrain/dem/5/33/24.terrain")
            tell(signal.SIGTERM)
        try:
            code = daemon.process.wait(60)
        except subprocess.TimeoutExpired:
            tell(signal.SIGKILL)
            code = None
        daemon.stop()
        return answers, code, "".join(daemon.log)


def what_is_wrong(right):
    """With a life that nothing went wrong in."""
    answers, code, log = right
    if code == 0 and all(status in (200, 201) for status, _ in answers.values()):
        return ""
    return f"{code}, {[(key, status) for key, (status, _) in answers.items()]} without a fault: {log[-300:]}"


def judge(right, got, ended_by_others=lambda log: False):
    """What is wrong with `got`, beside a life without a fault: wrong bytes, the client's fault, a crash."""
    answers, code, log = got
    if code is None:
        return "does not end"
    if code < 0 or code not in HONEST | {0} and not ended_by_others(log):
        return f"ended with {code}: {log.strip()[-300:]}"
    for key, (status, body) in answers.items():
        where = PATHS[key] if isinstance(key, int) else key
        if status == 200 and key not in OTHERWISE and body != right[0][key][1]:
            return f"wrong bytes with 200 for {where}"
        if 400 <= status < 500 and status != 429:
            return f"{status} for {where}: {body[:400]!r}"
    return ""
