"""From the address in the configuration to a link."""

import re
from collections.abc import Mapping
from urllib.parse import SplitResult, parse_qsl, urlsplit

from transports.errors import LinkError
from transports.link import Clock, Link
from transports.serial_port import SerialLink
from transports.tcp import TcpLink

DEFAULT_BAUD = 9600
ALLOWED = "tcp://HOST:PORT, serial:///dev/ttyUSB0?baud=9600, serial://COM3?baud=9600, /dev/ttyUSB0 or COM3"
_BARE_PORT = re.compile(r"COM\d+|/dev/\S+", re.IGNORECASE)


def open_link(url: str, clock: Clock, *, timeout_s: float = 2.0) -> Link:
    """Open the link at `url`.

    Parameters
    ----------
    url : str
        `tcp://HOST:PORT`, `serial://PORT?baud=RATE`, or the bare name of a serial port at 9600 baud.
    clock : Clock
        Stamps the times of what is sent.
    timeout_s : float
        How long a TCP connection may take to open.

    Raises
    ------
    LinkError
        The address is malformed, or nothing is there.
    """
    if _BARE_PORT.fullmatch(url):
        return SerialLink(url, DEFAULT_BAUD, clock)
    try:
        parts = urlsplit(url)
        if parts.scheme == "tcp":
            host, port = host_and_port(parts)
            return TcpLink(host, port, clock, timeout_s=timeout_s)
        if parts.scheme == "serial":
            return SerialLink(parts.netloc + parts.path, _baud(dict(parse_qsl(parts.query))), clock)
    except ValueError as error:
        raise LinkError(f"link {url!r}: {error}; allowed are {ALLOWED}") from error
    raise LinkError(f"link {url!r} is no address; allowed are {ALLOWED}")


def host_and_port(parts: SplitResult) -> tuple[str, int]:
    """Return host and port of a TCP address; ValueError when one is missing."""
    if not parts.hostname or parts.port is None or parts.path or parts.query or parts.fragment:
        raise ValueError("a TCP address is a host and a port")
    return parts.hostname, parts.port


def _baud(options: Mapping[str, str]) -> int:
    if unknown := sorted(set(options) - {"baud"}):
        raise ValueError(f"unknown option {', '.join(unknown)}")
    baud = int(options.get("baud", DEFAULT_BAUD))
    if baud < 1:
        raise ValueError(f"baud {baud} is not positive")
    return baud
