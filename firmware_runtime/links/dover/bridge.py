"""Ports of a running robot for peers of the paper: a UDP port of this machine for each number.

What leaves an output port is sent as `%f` text, number by number (`imu.sample.rate.2` is the third
part of field `rate`); a number that comes is put into an input port of type float. The run is
spoken with by its ports socket, and knows nothing of UDP.
"""

import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from selectors import EVENT_READ, DefaultSelector
from time import monotonic_ns
from typing import Any, Final, NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.dover.dover import LOOPBACK, bound_to, waiting_in
from firmware_runtime.links.ports.datagrams import MOST_PORTS, RENEW_EVERY, message_of, said_in
from firmware_runtime.links.ports.ports_client import PortsClient
from firmware_runtime.links.ports.robot_end import NoAnswer, RobotEnd
from firmware_runtime.models.dover import Refused, number_of_text, text_of_number

SILENT_AFTER: Final = 3 * RENEW_EVERY
_AT_ONCE: Final = 256


class Signal(NamedTuple):
    """A number that leaves the robot: which part of an output port's value, and where it goes."""

    name: str
    port: str
    parts: tuple[str, ...]
    udp_port: int


class DoverBridge:
    """Between a run's ports socket and UDP on loopback.

    `sends` and `takes` have the UDP port by signal and by input port. Raises ConfigError for a
    signal or a port that the run has not and for a UDP port that is taken, NoAnswer without a run.
    `say` is given a sentence once for each signal of which something that came was no number.
    """

    def __init__(
        self,
        robot: Path,
        sends: Mapping[str, int],
        takes: Mapping[str, int],
        say: Callable[[str], None],
    ) -> None:
        with PortsClient(robot) as client:
            self._signals = _signals(client.ports(), sends, takes)
        self.sent = self.taken = self.refused = 0
        """Numbers since the start; those refused are no finite number that fits."""
        self._robot, self._say_once, self._complained = robot, say, set[str]()
        watched = sorted({signal.port for signal in self._signals})
        self._request = message_of(watch=watched)
        self._renew_at, self._answered_at = 0, monotonic_ns()
        self._selector = DefaultSelector()
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._end = RobotEnd(robot)
        self._selector.register(self._end, EVENT_READ)
        for port, udp_port in takes.items():
            self._selector.register(bound_to(udp_port, "--take"), EVENT_READ, port)

    def wake_by(self, descriptor: int) -> None:
        """Let `work` return early, too, when this becomes readable."""
        self._selector.register(descriptor, EVENT_READ, self)

    def work(self) -> None:
        """Carry what there is; wait for it, for two seconds at most. Raises NoAnswer."""
        now = monotonic_ns()
        if now - self._answered_at > SILENT_AFTER:
            raise NoAnswer(
                "the run has fallen silent", where=self._robot, expected="it to be alive"
            )
        if now >= self._renew_at:
            self._renew_at = now + RENEW_EVERY
            self._say(self._request)
        for key, _ in self._selector.select((self._renew_at - now) / SECOND):
            if key.data is None:
                self._from_robot()
            elif isinstance(key.data, str):
                self._from_udp(key.fileobj, key.data)  # type: ignore[arg-type]  # a socket

    def close(self) -> None:
        """Close the sockets."""
        for key in list(self._selector.get_map().values()):
            if key.data is not self:
                key.fileobj.close()  # type: ignore[union-attr]  # a socket or an end
        self._selector.close()
        self._udp.close()

    def _from_robot(self) -> None:
        for message in self._end.received():
            said = said_in(message)
            if said.watching is not None:
                self._answered_at = monotonic_ns()
            for signal in self._signals:
                if signal.port == said.port:
                    self._send(signal, said.value)

    def _send(self, signal: Signal, value: object) -> None:
        try:
            text = text_of_number(_number(value, signal.parts))
        except (Refused, LookupError, TypeError, ValueError, OverflowError):
            self.refused += 1
            self._complain(f"--send {signal.name}", f"no number that fits in {value}: not sent")
            return
        with suppress(OSError):  # no room, or no peer at the moment
            self._udp.sendto(text.encode(), (LOOPBACK, signal.udp_port))
            self.sent += 1

    def _from_udp(self, taken: socket.socket, port: str) -> None:
        """Take the newest of the numbers that have come to a port since the last poll."""
        values = []
        for text in waiting_in(taken, _AT_ONCE):
            try:
                values.append(number_of_text(text.decode("latin-1")))
            except Refused as why:
                self.refused += 1
                self._complain(f"--take {port}", f"{why}: not taken")
        if values:
            self.taken += 1
            self._say(message_of(port=port, value=values[-1]))

    def _complain(self, signal: str, why: str) -> None:
        """Say what is wrong with a signal, the first time."""
        if signal not in self._complained:
            self._complained.add(signal)
            self._say_once(f"{signal}: {why}")

    def _say(self, request: bytes) -> None:
        try:
            self._end.send(request)
        except BlockingIOError:
            return  # no room now: the next one, then
        except OSError as error:
            raise NoAnswer(error.strerror, where=self._robot, expected="a run") from error


def _number(value: Any, parts: tuple[str, ...]) -> float:  # noqa: ANN401 -- what JSON bears
    """A part of a value as a number. Raises LookupError, TypeError or ValueError if it is none."""
    for part in parts:
        value = value[int(part)] if isinstance(value, list) else value[part]
    if not isinstance(value, bool | int | float):
        raise TypeError(type(value).__name__)
    return float(value)


def _signals(
    ports: tuple[dict[str, str], ...], sends: Mapping[str, int], takes: Mapping[str, int]
) -> list[Signal]:
    """Raises ConfigError with all that the run does not have."""
    outputs = [port["name"] for port in ports if port["direction"] == "out"]
    inputs = {
        port["name"] for port in ports if (port["direction"], port["type"]) == ("in", "float")
    }
    faults = [
        f"--take {name}: no input port of type float; expected one of {', '.join(inputs) or 'none'}"
        for name in takes
        if name not in inputs
    ]
    signals: list[Signal] = []
    for name, udp_port in sends.items():
        port = max(_heads(name, outputs), key=len, default="")
        parts = tuple(name.removeprefix(port).split(".")[1:])
        signals.append(Signal(name, port, parts, udp_port))
        if not port:
            faults.append(f"--send {name}: no such output port; `show BOARD --ports` lists them")
    if len({signal.port for signal in signals}) > MOST_PORTS:
        faults.append(f"--send: more than {MOST_PORTS} output ports; expected fewer")
    if faults:
        raise ConfigError("dover", faults)
    return signals


def _heads(name: str, outputs: list[str]) -> Iterator[str]:
    """The output ports that a signal can be a part of."""
    return (each for each in outputs if name == each or name.startswith(f"{each}."))
