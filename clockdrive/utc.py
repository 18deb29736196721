"""Moments as answers, remarks and files say them."""

from datetime import UTC, datetime


def utc(time: float) -> str:
    """POSIX seconds as UTC, to the millisecond."""
    moment = datetime.fromtimestamp(round(time, 3), UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"
