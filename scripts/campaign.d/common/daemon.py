"""The daemon under test, and bytes to and from it."""
import re
import signal
import socket
import subprocess
import threading
import urllib.request

from .programme import ROOT, TIND

DEM = ROOT / "testdata/rainier.tif"


class Daemon:
    """`tind serve` at a free port. Its log is kept in `log`, line by line."""

    def __init__(self, *args, dems=(DEM,), prefix=(), env=None, preexec=None):
        self.process = subprocess.Popen([*map(str, prefix), str(TIND), "serve", *map(str, dems), "--listen", "127.0.0.1:0", *map(str, args)],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env, preexec_fn=preexec, errors="replace")
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

    def metric(self, name):
        found = re.findall(rf"^{re.escape(name)}(?:{{[^}}]*}})? (\S+)$", self.get("/metrics").decode(), re.M)
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


class Wire:
    """A connection, byte for byte."""

    def __init__(self, port, timeout=20, source="127.0.0.1"):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout, (source, 0))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.buffer = b""

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            pass  # refused before its end was there

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
