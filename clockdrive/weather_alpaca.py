"""Weather from an ASCOM Alpaca ObservingConditions device: HTTP with JSON answers, on this computer or near it.

`GET …/observingconditions/N/pressure | temperature | humidity`: hPa at the observatory, degrees Celsius, percent;
`timesincelastupdate` gives the age in seconds. A property that the device lacks is error 0x400; a device that nobody
has connected is 0x407, and is connected. It is left so: others may be using it. No redirect or proxy is followed.
"""

import http.client
import json
import os
import socket
import threading
from contextlib import suppress
from typing import Any
from urllib.parse import urlencode, urlsplit

from clockdrive.errors import WeatherError
from clockdrive.weather_sources import MOST_BYTES, Measured, quantity

_NOT_IMPLEMENTED, _VALUE_NOT_SET, _NOT_CONNECTED = 0x400, 0x402, 0x407
_DEVICE = "/api/v1/observingconditions/0"
_REPLY_S = 3.0
_ALL_S = 10.0
_SATURATED = 105.0  # percent that a hygrometer may show in fog


class AlpacaSource:
    """An ObservingConditions device.

    Parameters
    ----------
    url : str
        Of the server (`http://192.168.1.20:11111`, for device 0) or of the device
        (`http://192.168.1.20:11111/api/v1/observingconditions/1`).
    reply_s, all_s : float
        How long one answer and all of them may take.

    Raises
    ------
    WeatherError
        It is no such address.
    """

    def __init__(self, url: str, reply_s: float = _REPLY_S, all_s: float = _ALL_S) -> None:
        self.name = f"alpaca:{url}"
        self._reply_s, self._all_s = reply_s, all_s
        self._transaction = 0
        self._socket: socket.socket | None = None  # the one that is waited for
        self._expired = threading.Event()
        try:
            address = urlsplit(url)
            self._host, self._port = address.hostname, address.port
        except ValueError as error:
            raise self._error(str(error), "write http://ADDRESS:PORT") from None
        if address.scheme not in {"http", "https"} or not self._host or not url.isascii() or " " in url:
            raise self._error("no address of an Alpaca server", "write http://ADDRESS:PORT")
        self._connection_type = (
            http.client.HTTPSConnection if address.scheme == "https" else http.client.HTTPConnection
        )
        self._path = address.path.rstrip("/") or _DEVICE

    def measure(self, now: float) -> Measured:
        """Ask the device for its three values and their age."""
        assert self._host is not None  # noqa: S101 - checked when it was made
        connection = self._connection_type(self._host, self._port, timeout=self._reply_s)
        self._expired = expired = threading.Event()

        def expire() -> None:
            expired.set()
            if self._socket is not None:
                with suppress(OSError):
                    self._socket.shutdown(socket.SHUT_RDWR)

        # A timeout of the socket starts anew with every byte: this one ends all.
        late = threading.Timer(self._all_s, expire)
        late.daemon = True
        late.start()
        try:
            return self._measured(connection, now)
        except (OSError, http.client.HTTPException, ValueError, RecursionError) as error:
            reason = f"no usable answer ({str(error)[:120] or type(error).__name__})"
            if isinstance(error, TimeoutError):
                reason = f"no answer within {self._reply_s:g} s"
            if expired.is_set():
                reason = f"no whole answer within {self._all_s:g} s"
            raise self._error(reason, "check the address and that the server runs") from None
        finally:
            late.cancel()
            connection.close()
            self._socket = None

    def _measured(self, connection: http.client.HTTPConnection, now: float) -> Measured:
        pressure, temperature, humidity = (
            self._value(connection, name) for name in ("pressure", "temperature", "humidity")
        )
        if pressure is None and temperature is None:
            raise self._error("the device has neither pressure nor temperature", "name another one")
        if humidity is not None and 100.0 < humidity <= _SATURATED:
            humidity = 100.0
        ages = [
            self._value(connection, "timesincelastupdate", SensorName=sensor)
            for sensor, value in (("Pressure", pressure), ("Temperature", temperature))
            if value is not None
        ]
        age = max((age for age in ages if age is not None), default=0.0)
        return Measured(pressure, temperature, None if humidity is None else humidity / 100.0, now - max(age, 0.0))

    def _value(self, connection: http.client.HTTPConnection, name: str, **arguments: str) -> float | None:
        """A property; None when the device lacks it."""
        answer = self._asked(connection, "GET", name, arguments)
        if answer["ErrorNumber"] == _NOT_CONNECTED:
            self._asked(connection, "PUT", "connected", {"Connected": "True"})
            answer = self._asked(connection, "GET", name, arguments)
        number = int(quantity(self.name, "ErrorNumber", answer["ErrorNumber"]))
        if number in {_NOT_IMPLEMENTED, _VALUE_NOT_SET}:
            return None
        if number != 0:
            message = str(answer.get("ErrorMessage", ""))[:200]
            raise self._error(
                f"{name}: error {number:#x} of the device, {message!r}", "look at the device's own page"
            )
        return quantity(self.name, name, answer.get("Value"))

    def _asked(
        self, connection: http.client.HTTPConnection, method: str, name: str, arguments: dict[str, str]
    ) -> dict[str, Any]:
        self._transaction += 1
        client = {"ClientID": str(os.getpid() % 0xFFFF + 1), "ClientTransactionID": str(self._transaction)}
        form, path = urlencode({**arguments, **client}), f"{self._path}/{name}"
        if method == "GET":
            connection.request(method, f"{path}?{form}")
        else:
            connection.request(method, path, form, {"Content-Type": "application/x-www-form-urlencoded"})
        self._socket = connection.sock  # the connection itself forgets it before the whole answer is there
        if self._expired.is_set():
            raise TimeoutError
        with connection.getresponse() as reply:
            content = reply.read(MOST_BYTES + 1)
        if reply.status != http.client.OK:
            reason = content[:120].decode("utf-8", "replace").strip() or reply.reason
            raise self._error(f"{path}: HTTP status {reply.status}, {reason!r}", "check address and device number")
        if len(content) > MOST_BYTES:
            raise self._error(f"{path}: more than {MOST_BYTES} bytes", "this is no Alpaca device; check the address")
        answer = json.loads(content)
        if not isinstance(answer, dict):
            raise self._error(f"{path}: no JSON object", "this is no Alpaca device; check the address")
        return {"ErrorNumber": 0, **answer}

    def _error(self, what: str, remedy: str) -> WeatherError:
        return WeatherError(f"{self.name}: {what}; {remedy}")
