"""A recorded run that answers the questions of served doubles.

The enable line follows its commands, and a run's result is what the robot itself knows: no world
is behind it. Faults cannot be added to a recording.
"""

import errno
import os
from collections.abc import Callable

from firmware_runtime.hal.served.packets import (
    Conclude,
    Enable,
    FaultQuestion,
    Read,
    Refused,
    Standing,
    Transfer,
    Write,
)
from sim_doubles.recorded.lines import RecordedBus, RecordedPort, Rules
from sim_doubles.recorded.traffic import Traffic
from sim_doubles.served.service import Carried, Service, line_of


class RecordedService(Service):
    """The lines of a recorded run of `board`.

    `over` is called once all that was recorded has been asked for, `left` when the last client goes
    after that.
    """

    def __init__(self, board: str, traffic: Traffic, rules: Rules) -> None:
        self.over: Callable[[], None] = lambda: None
        self.left: Callable[[], None] = lambda: None
        self._board = board
        self._was_over = False
        self._clients: set[int] = set()
        self._opened: set[tuple[int, str]] = set()
        ports = traffic.ports
        self.ports = {
            name: RecordedPort(name, traffic.lines[name], rules) for name in sorted(ports)
        }
        self.buses = {
            name: RecordedBus(name, recorded, rules)
            for name, recorded in traffic.lines.items()
            if name not in ports
        }
        self._lines: tuple[RecordedBus | RecordedPort, ...] = (
            *self.buses.values(),
            *self.ports.values(),
        )

    @property
    def is_over(self) -> bool:
        """Return whether every line is at its end."""
        return all(each.is_over for each in self._lines)

    @property
    def last_at(self) -> int:
        """The instant of the run that its lines have come to, ns."""
        return max(each.last_at for each in self._lines)

    @property
    def next_number(self) -> int | None:
        """The first transaction that has not been asked for; None at the end."""
        due = (each.due for each in self._lines if not each.is_over)
        return min((each.number for each in due if each is not None), default=None)

    def answer(self, packet: bytes | memoryview, client: int = 0) -> bytes:
        """Answer a client's packet."""
        self._clients.add(client)
        answer = super().answer(packet, client)
        if not self._was_over and self.is_over:
            self._was_over = True
            self.over()
        return answer

    def release(self, client: int) -> None:
        """A client has gone."""
        self._clients.discard(client)
        self._opened = {each for each in self._opened if each[0] != client}
        if self._was_over and not self._clients:
            self.left()

    def _standing(self) -> Standing:
        return Standing(self._board, self.last_at, {}, {})

    def _result(self, asked: Conclude) -> dict[str, object]:
        return dict(asked.own)

    def _faults(self, asked: FaultQuestion) -> Refused:  # noqa: ARG002 -- whichever it is
        return Refused("a recording: no fault can be added to it; expected `doubles serve`")

    def _carried_out(self, asked: Carried, client: int) -> bytes:
        match asked:
            case Enable():
                return b""
            case Transfer(bus, address, messages):
                return line_of(self.buses, bus).transfer(address, messages)
            case Write(port, data):
                line_of(self.ports, port).write(data)
                return b""
            case Read(port):
                return self._read(line_of(self.ports, port), port, client)
        raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))

    def _read(self, line: RecordedPort, port: str, client: int) -> bytes:
        """The first read of a client throws away what arrived before it opened the port: nothing.

        A client that only comes to switch off takes no bytes with it.
        """
        opened = (client, port)
        if opened in self._opened:
            return line.read()
        self._opened.add(opened)
        return b""
