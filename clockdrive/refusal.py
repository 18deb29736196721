"""What is answered in place of what was asked for."""

from typing import Any

from clockdrive.utc import utc


def refusal(reason: str, reachable: float | None = None) -> dict[str, Any]:
    """Why something was not done, and when it can be."""
    answer: dict[str, Any] = {"ok": False, "reason": reason}
    return answer if reachable is None else {**answer, "reachable_utc": utc(reachable)}
