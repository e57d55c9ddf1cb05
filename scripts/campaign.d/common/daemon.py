"""The daemon under test, and bytes to and from it."""
import os
import re
import signal
import socket
import subprocess
import threading
import urllib.request
from pathlib import Path

from .programme import ROOT, TIND

DEM = ROOT / "testdata/rainier.tif"


# As systemd does: the socket as descriptor 3, and the environment says of which process. bash, since dash knows one digit.
HANDS_OVER = 'exec 3<&"$0"; [ "$0" = 3 ] || eval "exec $0<&-"; export LISTEN_PID=$$ LISTEN_FDS=1; exec "$@"'


class Daemon:
    """`tind serve`, at a free port where none is given, or at a socket that somebody listens at and keeps. Its log is kept in
    `log`, line by line."""

    def __init__(self, *args, dems=(DEM,), prefix=(), env=None, preexec=None, port=0, kept=None):
        fds = (kept.fileno(),) if kept else ()
        prefix = ("bash", "-c", HANDS_OVER, *fds, *prefix) if kept else prefix
        self.process = subprocess.Popen([*map(str, prefix), str(TIND), "serve", *map(str, dems), "--listen", f"127.0.0.1:{port}", *map(str, args)],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env, preexec_fn=preexec, errors="replace",
                                        pass_fds=fds)
        self.log, self.url, self.port = [], None, None
        self.reader = threading.Thread(target=self.collect, daemon=True)
        self.reader.start()
        for line in self.process.stdout:
            found = re.search(r"http://[\d.]+:(\d+)/", line)
            if found:
                self.url, self.port = found.group(0), int(found.group(1))
                break
        if self.url is None:
            self.process.wait()

    def collect(self):
        for line in self.process.stderr:
            self.log.append(line)

    def get(self, path, timeout=60):
        with urllib.request.urlopen(self.url + path.lstrip("/"), timeout=timeout) as reply:
            return reply.read()

    def metric(self, name, labels="[^}]*"):
        """The sum over its labels; `labels`, a pattern, says which of them."""
        found = re.findall(rf"^{re.escape(name)}(?:{{{labels}}})? (\S+)$", self.get("/metrics").decode(), re.M)
        return sum(map(float, found))

    def stop(self, sign=signal.SIGTERM, timeout=60):
        """Its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(sign)
        try:
            code = self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            code = None
        self.reader.join(5)
        self.process.stdout.close()
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


def rss_kb(pid, what="VmRSS"):
    with open(f"/proc/{pid}/status") as status:
        return next((int(line.split()[1]) for line in status if line.startswith(what)), 0)


def family(pid):
    """A process, and all that it or one of them has begun: of a daemon also those that read its DEMs."""
    found = [pid]
    for one in found:  # grows while it is gone through
        for children in Path(f"/proc/{one}/task").glob("*/children"):
            try:
                found += map(int, children.read_text().split())
            except OSError:
                pass  # that thread has ended
    return found


def held(pid):
    """(KiB of memory, descriptors) of a daemon and its children together. What they share counts for each; what was swapped
    out counts, too: it is needed still."""
    memory = files = 0
    for one in family(pid):
        try:
            memory += rss_kb(one) + rss_kb(one, "VmSwap")
            files += len(os.listdir(f"/proc/{one}/fd"))
        except (FileNotFoundError, ProcessLookupError):
            pass  # it has ended
    return memory, files


class Wire:
    """A connection, byte for byte."""

    def __init__(self, port, timeout=20, source="127.0.0.1"):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout, (source, 0))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.buffer = b""

    def send(self, data):
        """Whether all of it could be sent. Where it could not, an answer may be there all the same: a refusal of its beginning."""
        try:
            self.socket.sendall(data)
        except OSError:
            return False
        return True

    def reply(self, head=False):
        """(status, fields, body) of one response, or None where the connection ends."""
        try:
            while b"\r\n\r\n" not in self.buffer:
                if not self.more():
                    return None
            top, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
            lines = top.decode("latin1").split("\r\n")
            fields = {k.strip().lower(): v.strip() for k, _, v in (line.partition(":") for line in lines[1:])}
            status = int(lines[0].split()[1])
            if status == 100:
                return self.reply(head)
            length = 0 if head or status in (204, 304) else int(fields.get("content-length", "0"))
            while len(self.buffer) < length:
                if not self.more():
                    return None
            body, self.buffer = self.buffer[:length], self.buffer[length:]
            return status, fields, body
        except (OSError, ValueError, IndexError):
            return None

    def more(self):
        data = self.socket.recv(65536)
        self.buffer += data
        return data

    def close(self):
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
