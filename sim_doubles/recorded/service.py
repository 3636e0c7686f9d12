"""A recorded run that answers the questions of served doubles.

The enable line follows its commands, and a run's result is what the robot itself knows: no world
is behind it. Faults cannot be added to a recording.
"""

import errno
import os
from collections.abc import Callable

from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.served.packets import (
    Answered,
    Asked,
    Conclude,
    Concluded,
    Done,
    Enable,
    Failed,
    Look,
    Part,
    Read,
    Standing,
    Strike,
    Transfer,
    Write,
)
from sim_doubles.recorded.lines import RecordedBus, RecordedPort, Rules
from sim_doubles.recorded.traffic import Traffic
from sim_doubles.served.service import line_of, reply


class RecordedService:
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

    def catch_up(self) -> int:
        """Nothing here happens by itself."""
        return NEVER

    def answer(self, packet: bytes | memoryview, client: int = 0) -> bytes:
        """Answer a client's packet."""
        self._clients.add(client)
        answer = reply(packet, lambda asked: self._answered(asked, client))
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

    def _answered(self, asked: Asked, client: int) -> Answered:
        match asked:
            case Look():
                return Standing(self._board, self.last_at, {}, {})
            case Conclude(_, own):
                return Concluded(dict(own))
            case Enable():
                return Done(b"")
        try:
            return Done(self._carried_out(asked, client))
        except OSError as error:
            return Failed(error.errno or errno.EIO)

    def _carried_out(self, asked: Transfer | Part | Write | Read | Strike, client: int) -> bytes:
        """Answer a transaction. Raises the OSError that was reported, or a refusal."""
        match asked:
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
