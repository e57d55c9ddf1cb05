"""HTTP to one server: JSON in and out, files to disk, patience where the server asks for it."""
from __future__ import annotations

import http.client
import json
import os
import time
import urllib.error
import urllib.parse
import urllib.request
from typing import Any, Mapping

from tind.errors import TindError

_CHUNK = 1 << 16
_LONGEST_PAUSE_S = 30.0


class Connection:
    """timeout_s: of one answer's silence. retries: of requests that were not carried out, since
    nobody listened, or the server had no room (503, 429): those may be sent again whatever they
    are. A GET is also sent again where its answer broke off."""

    def __init__(self, url: str, key: str | None, timeout_s: float, retries: int):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ValueError(f"{url!r} is no http:// or https:// URL")
        self.url = url.rstrip("/")
        self._key = key
        self._timeout_s = timeout_s
        self._retries = retries

    def get(self, path: str, query: Mapping[str, Any] | None = None) -> Any:
        """The JSON at a path."""
        return json.loads(self.get_bytes(path, query))

    def get_bytes(self, path: str, query: Mapping[str, Any] | None = None) -> bytes:
        return self._answer(self._request("GET", path, query))

    def post(self, path: str, body: Any, query: Mapping[str, Any] | None = None,
             headers: Mapping[str, str] | None = None) -> Any:
        """JSON, for JSON."""
        request = self._request("POST", path, query, json.dumps(body).encode(),
                                {"Content-Type": "application/json", **(headers or {})})
        return json.loads(self._answer(request))

    def delete(self, path: str) -> None:
        self._answer(self._request("DELETE", path))

    def download(self, path: str, file: str | os.PathLike[str]) -> None:
        """A resource as a file. What breaks off goes on where it was, if the resource is still the
        same one."""
        with open(file, "wb") as out:
            self._download(path, out)

    # ----------------------------------------------------------------------------------------------

    def _request(self, method: str, path: str, query: Mapping[str, Any] | None = None,
                 body: bytes | None = None,
                 headers: Mapping[str, str] | None = None) -> urllib.request.Request:
        url = self.url + path
        said = {name: value for name, value in (query or {}).items() if value is not None}
        if said:
            url += "?" + urllib.parse.urlencode(said)
        request = urllib.request.Request(url, data=body, method=method, headers=dict(headers or {}))
        request.add_header("User-Agent", "tind-python")
        if self._key:
            request.add_header("Authorization", f"Bearer {self._key}")
        return request

    def _answer(self, request: urllib.request.Request) -> bytes:
        for attempt in range(self._retries + 1):
            try:
                with self._open(request) as answer:
                    return answer.read()
            except (http.client.HTTPException, OSError) as error:
                if request.method != "GET" or attempt == self._retries:
                    raise TindError(f"{request.full_url}: the answer broke off: {error}") from error
                self._pause(attempt)
        raise AssertionError("the last attempt returns or raises")

    def _open(self, request: urllib.request.Request) -> Any:
        for attempt in range(self._retries + 1):
            last = attempt == self._retries
            try:
                return urllib.request.urlopen(request, timeout=self._timeout_s)
            except urllib.error.HTTPError as refused:
                with refused:
                    after = refused.headers.get("Retry-After", "")
                    problem = _json_or_none(refused.read())
                if refused.code not in (429, 503) or last:
                    raise TindError.of_problem(refused.code, problem) from None
                self._pause(attempt, float(after) if after.isdigit() else None)
            except urllib.error.URLError as unheard:
                if not isinstance(unheard.reason, ConnectionRefusedError) or last:
                    raise TindError(f"{self.url}: {unheard.reason}") from unheard
                self._pause(attempt)
        raise AssertionError("the last attempt returns or raises")

    @staticmethod
    def _pause(attempt: int, seconds: float | None = None) -> None:
        wait = 0.2 * 2**attempt if seconds is None else seconds
        time.sleep(min(wait, _LONGEST_PAUSE_S))

    def _download(self, path: str, out: Any) -> None:
        etag = None
        for attempt in range(self._retries + 1):
            request = self._request("GET", path)
            if etag and out.tell() > 0:
                request.add_header("Range", f"bytes={out.tell()}-")
                request.add_header("If-Range", etag)
            try:
                with self._open(request) as answer:
                    if answer.status != 206:
                        out.seek(0)
                        out.truncate()
                    etag = answer.headers.get("ETag")
                    expected = answer.headers.get("Content-Length")
                    got = 0
                    while chunk := answer.read(_CHUNK):
                        out.write(chunk)
                        got += len(chunk)
                if expected is None or got == int(expected):
                    return
                broken: Exception = EOFError(f"{got} of {expected} bytes")
            except (http.client.HTTPException, ConnectionError, TimeoutError) as error:
                broken = error
            if attempt == self._retries:
                raise TindError(f"{request.full_url}: the answer broke off: {broken}") from broken
            self._pause(attempt)


def _json_or_none(text: bytes) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return None
