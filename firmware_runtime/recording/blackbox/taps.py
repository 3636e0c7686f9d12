"""Taps on ports, the time of the lines, the interlock and models: they note every use.

Buses note their transactions themselves (`hal.accounted_bus`). A port stands next to the adapter or
double, below the counters, so that a use is noted that ended in an error.

Models: what leaves every output port, and what models of a world decide. A model of a world, such
as a rig's probe, is none of the robot's own. It sees a world that is not there in a replay, so what
it sent and when it wants to be called next is recorded.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.ports import OutPort, Sent
from firmware_runtime.hal.budget import LineTime
from firmware_runtime.hal.interlock import Interlock
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import how_it_failed
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE
from firmware_runtime.recording.blackbox.writer import Pending

Transfers: TypeAlias = list[tuple[Any, ...]]
"""The fields of a `section.Transfer` each."""
Now: TypeAlias = Callable[[], int]


class TappedPort(SerialPort):
    """Any serial port; `number` is its place among the lines."""

    def __init__(self, port: SerialPort, number: int, transfers: Transfers, now: Now) -> None:
        self.name = port.name
        self._port = port
        self._number = number
        self._transfers = transfers
        self._now = now

    def write(self, data: bytes) -> None:
        """Write, and note it."""
        self._noted(WRITE, bytes(data), lambda: self._port.write(data))

    def read_available(self) -> bytes:
        """Read, and note what had arrived."""
        return self._noted(READ, b"", self._port.read_available)

    def discard_input(self) -> None:
        """Throw away what has arrived, and note that."""
        self._noted(DISCARD, b"", self._port.discard_input)

    def close(self) -> None:
        """Close the port underneath."""
        self._port.close()

    def _noted(self, what: int, data: bytes, use: Callable[[], bytes | None]) -> bytes:
        try:
            answer = use() or b""
        except Exception as error:
            failed = how_it_failed(error)
            self._transfers.append((self._number, what, data, failed, self._now()))
            raise
        self._transfers.append((self._number, what, data, answer, self._now()))
        return answer


class TappedTime:
    """The time of the lines; `times` gets every instant and span that a line asks for, ns."""

    def __init__(self, time: LineTime, times: list[int]) -> None:
        self._time = time
        self._times = times

    def __call__(self) -> int:
        """Return the instant."""
        time = self._time
        self._times.append(now := time())
        return now

    def reach(self, at: int) -> None:
        """Go on to `at`."""
        self._time.reach(at)

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to where the lines are now."""
        self._times.append(elapsed := self._time.elapsed())
        return elapsed


def tapped_interlock(interlock: Interlock, answers: list[bool]) -> Interlock:
    """An interlock whose answers are appended to a list."""

    def is_enabled() -> bool:
        answers.append(enabled := interlock())
        return enabled

    return is_enabled


def own_atomics(component: Component) -> Iterator[Atomic]:
    """The atomics of a robot, before a world is attached to it."""
    return (each for each in with_all_below(component) if isinstance(each, Atomic))


def output_ports(atomics: Iterable[Atomic]) -> list[OutPort[object]]:
    """All of them, in the order of their numbers."""
    return [port for atomic in atomics for port in atomic.out_ports.values()]


def tap_outputs(
    atomics: Iterable[Atomic],
    sent: Sent,
    numbers: Iterable[int] | None = None,
    unlike: list[object] | None = None,
) -> None:
    """Append what leaves every output port from now on, by these numbers or in order."""
    ports = output_ports(atomics)
    for number, port in zip(numbers or range(len(ports)), ports, strict=True):
        port.record(number, sent, unlike)


def tapped_world(atomic: Atomic, functions: Functions, pending: Pending) -> Functions:
    """What to call for a world's model, so that it is recorded."""
    sent, world = pending.sent, pending.world
    send, transit, take, confluent = (
        functions.output,
        functions.internal,
        functions.external,
        functions.confluent,
    )

    def output() -> None:
        before = len(sent)
        send()
        world.append((len(sent) - before) // 2)

    def internal() -> None:
        transit()
        world.append(atomic.sigma)

    def external(elapsed: int) -> None:
        take(elapsed)
        world.append(atomic.sigma)

    def both() -> None:
        confluent()  # type: ignore[misc]  # only called where there is one
        world.append(atomic.sigma)

    return Wrapped(atomic, output, internal, external, None if confluent is None else both)
