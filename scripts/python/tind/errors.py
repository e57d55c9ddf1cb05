"""What goes wrong, in one type."""
from __future__ import annotations

from typing import Any


class TindError(Exception):
    """A request that was refused, a job that failed, or a server that cannot be reached.

    status   HTTP status; 0 where there was no answer. Of the local program: its exit code
    errors   what is wrong with which parameter: [{"parameter": ..., "detail": ...}]
    request_id   what the server's log has it under, if the server said one
    """

    def __init__(self, message: str, status: int = 0, errors: list[dict[str, Any]] | None = None,
                 request_id: str | None = None):
        super().__init__(message)
        self.status = status
        self.errors = errors or []
        self.request_id = request_id

    @staticmethod
    def of_problem(status: int, problem: Any) -> TindError:
        """Of a problem document (RFC 9457), or of whatever came in its place."""
        if not isinstance(problem, dict):
            return TindError(f"HTTP {status}", status)
        message = str(problem.get("detail") or problem.get("title") or f"HTTP {status}")
        return TindError(message, status, problem.get("errors"), problem.get("requestId"))
