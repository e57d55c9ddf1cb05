"""Work that takes longer than an answer: what runs, and what came of it."""
from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
import weakref
from typing import Any, Callable

from tind.connection import Connection
from tind.errors import TindError

_FIRST_LOOK_S = 0.02
_SELDOMEST_LOOK_S = 1.0


class Result:
    """What a process made: a file (of most), a report (of some), or both."""

    def __init__(self, name: str, report: dict[str, Any] | None):
        self.name = name  #: of the output: "mesh", "raster", "report", ...
        self.report = report  #: as `--json` prints it; None where the process has none

    def save(self, path: str | os.PathLike[str]) -> Result:
        """Writes the file, which is there when all of it is; of what is a report alone, that as
        JSON. Returns the result itself."""
        part = os.fspath(path) + ".part"
        try:
            self._write(part)
            os.replace(part, path)
        finally:
            if os.path.exists(part):
                os.remove(part)
        return self

    def bytes(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "result")
            self.save(path)
            with open(path, "rb") as file:
                return file.read()

    def _write(self, path: str) -> None:
        with open(path, "w", encoding="utf-8") as out:
            json.dump(self.report, out, indent=2)
            out.write("\n")


class ServedResult(Result):
    def __init__(self, connection: Connection, name: str, where: str,
                 report: dict[str, Any] | None):
        super().__init__(name, report)
        self._connection = connection
        self._where = where

    def _write(self, path: str) -> None:
        self._connection.download(self._where, path)


class LocalResult(Result):
    """Of the local program, in a folder that lives as long as this does."""

    def __init__(self, name: str, folder: str, file: str):
        super().__init__(name, None)
        self._file = os.path.join(folder, file)
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    def _write(self, path: str) -> None:
        shutil.copyfile(self._file, path)


class Job:
    """A job of the server. It goes on whether or not anybody asks; who has its id may."""

    def __init__(self, connection: Connection, job_id: str):
        self._connection = connection
        self.id = job_id

    def status(self) -> dict[str, Any]:
        """{"status": "accepted" | "running" | "successful" | "failed" | "dismissed", "progress": ...}"""
        return self._connection.get(f"/jobs/{self.id}")

    def wait(self, timeout_s: float | None = None,
             progress: Callable[[float, str], None] | None = None) -> Result:
        """The result, when it is there. TindError where the job failed or was dismissed;
        TimeoutError after `timeout_s`, and the job goes on. `progress` gets per cent and a word."""
        began = time.monotonic()
        pause = _FIRST_LOOK_S
        while True:
            status = self.status()
            if progress:
                progress(float(status.get("progress", 0)), str(status.get("message", "")))
            if status["status"] == "successful":
                return self._result()
            if status["status"] in ("failed", "dismissed"):
                self._connection.get(f"/jobs/{self.id}/results")  # says why, as an error
                raise TindError(str(status.get("message", status["status"])))
            if timeout_s is not None and time.monotonic() - began + pause > timeout_s:
                raise TimeoutError(f"job {self.id} is {status['status']} after {timeout_s} s")
            time.sleep(pause)
            pause = min(pause * 1.5, _SELDOMEST_LOOK_S)

    def dismiss(self) -> None:
        """Ends the job, or drops the files of one that has ended."""
        self._connection.delete(f"/jobs/{self.id}")

    def _result(self) -> Result:
        document = self._connection.get(f"/jobs/{self.id}/results")
        report, file = None, None
        for name, output in document.items():
            if "value" in output:
                report = output["value"]
            elif file is None:
                file = name
        if file is None:
            return Result("report", report)
        # Not the document's link: it leads past the path that a proxy has put in front.
        return ServedResult(self._connection, file, f"/jobs/{self.id}/results/{file}", report)
