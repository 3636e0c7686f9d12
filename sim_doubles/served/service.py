"""Questions about doubles and their answers, packet by packet, whatever carries the packets."""

import errno
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TypeAlias, TypeVar

from firmware_runtime.board.rig import Truthful
from firmware_runtime.board.struck_doubles import NO_DEVICES, HasDevices, StruckDoubles
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.served.packets import (
    Answer,
    Answered,
    Asked,
    ClearFaults,
    Conclude,
    Concluded,
    Done,
    Enable,
    Failed,
    FaultList,
    FaultQuestion,
    ListFaults,
    Look,
    Part,
    Read,
    Refused,
    Standing,
    Transfer,
    Write,
    encode,
    read_question,
)
from firmware_runtime.hal.strike import Strike, Struck
from firmware_runtime.statistics.json_values import plain
from sim_doubles.clock import Now
from sim_doubles.rigs.board_rig import DoublesRig
from sim_doubles.served.logs import OutputLog

T = TypeVar("T")
Carried: TypeAlias = Transfer | Part | Write | Read | Enable
"""Questions whose answer is bytes, or an errno."""


class Service(ABC):
    """Service behind a server of doubles."""

    def catch_up(self) -> int:
        """Bring all up to now; return the instant until which nothing happens by itself, ns."""
        return NEVER

    def answer(self, packet: bytes | memoryview, client: int = 0) -> bytes:
        """Answer a client's packet; what is no question is refused and does nothing."""
        try:
            question = read_question(packet)
        except (ValueError, RecursionError) as error:
            return encode(Answer(0, Refused(f"no question: {error}")))
        return encode(Answer(question.number, self._answered(question.asked, client)))

    @abstractmethod
    def release(self, client: int) -> None:
        """Free what a client held that has gone."""

    @abstractmethod
    def _standing(self) -> Standing:
        """Say what is served and how it stands."""

    @abstractmethod
    def _result(self, asked: Conclude) -> dict[str, object]:
        """Return how a run ended."""

    @abstractmethod
    def _faults(self, asked: FaultQuestion) -> Answered:
        """Make or clear faults, and list them; or refuse to."""

    @abstractmethod
    def _carried_out(self, asked: Carried, client: int) -> bytes:
        """Carry out anything else. Raises the OSError that an adapter reports."""

    def _answered(self, asked: Asked, client: int) -> Answered:
        match asked:
            case Look():
                return self._standing()
            case Conclude():
                return Concluded(self._result(asked))
            case Strike() | ListFaults() | ClearFaults():
                return self._faults(asked)
        try:
            return Done(self._carried_out(asked, client))
        except OSError as error:
            # the errors of a double's serial line have no errno
            return Failed(error.errno or errno.EIO)


class DoublesService(Service):
    """The doubles of a board, or of single chips; faults are made at its `devices` by name.

    While a question is answered, only wire time passes on their clock.
    """

    def __init__(
        self,
        board: str,
        rig: DoublesRig,
        now: Now,
        log: OutputLog,
        devices: HasDevices = NO_DEVICES,
    ) -> None:
        self._board = board
        self._devices = devices
        self._struck = StruckDoubles(rig, devices, now)
        self._drivers: set[int] = set()
        self._began_at: int | None = None
        self._rig = rig
        self._now = now
        self._log = log
        self._holder: int | None = None  # the client that has the enable line

    def catch_up(self) -> int:
        """Bring world and log up to now; return when the next output changes by itself."""
        self._rig.catch_up()
        return self._log.catch_up(self._now())

    def answer(self, packet: bytes | memoryview, client: int = 0) -> bytes:
        """Answer a client's packet; the log has what changed before and by it."""
        self._log.catch_up(self._now())
        answer = super().answer(packet, client)
        self._log.catch_up(self._now())
        return answer

    def release(self, client: int) -> None:
        """Free what a client held that has gone, as the kernel does."""
        self._drivers.discard(client)
        if self._holder == client:
            self._let_through(client, enabled=False)
            self._holder = None
            self._log.catch_up(self._now())

    def _standing(self) -> Standing:
        at = self._now()
        truth = self._rig.truth() if isinstance(self._rig, Truthful) else {}
        return Standing(
            self._board,
            at,
            self._rig.outputs,
            self._rig.levels(at),
            {k: plain(v) for k, v in truth.items()},
        )

    def _result(self, asked: Conclude) -> dict[str, object]:
        return self._rig.result(asked.elapsed, asked.own)

    def _carried_out(self, asked: Carried, client: int) -> bytes:
        if not isinstance(asked, Enable) and client not in self._drivers:
            self._note_driver(client)
        match asked:
            case Transfer(bus, address, messages):
                return line_of(self._rig.buses, bus).transfer(address, messages)
            case Part(bus, parts, continues, holds):
                line = line_of(self._rig.buses, bus)
                return line.transfer_parts(parts, continues=continues, holds=holds)
            case Write(port, data):
                line_of(self._rig.ports, port).write(data)
                return b""
            case Read(port):
                return line_of(self._rig.ports, port).read_available()
            case Enable(enabled):
                self._let_through(client, enabled=enabled)
                return b""

    def _let_through(self, client: int, *, enabled: bool) -> None:
        """Set the enable line. Raises the OSError of a line that is absent or another's."""
        line = self._rig.enable
        if line is None:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        if self._holder not in {None, client}:
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
        self._holder = client
        line.set(enabled)

    def _faults(self, asked: FaultQuestion) -> Answered:
        try:
            match asked:
                case Strike():
                    self._log_fault(self._struck.strike(asked, self._now()))
                case ClearFaults():
                    self._struck.clear()
                    self._log.event(self._now(), "cleared")
        except ConfigError as error:
            return Refused(error.faults[0])
        return self._fault_list()

    def _fault_list(self) -> FaultList:
        struck = self._struck
        return FaultList(
            self._board,
            None if self._devices.source is None else str(self._devices.source.absolute()),
            tuple(self._devices.assignments),
            self._now(),
            self._began_at,
            tuple(struck.kinds),
            tuple(struck.places),
            tuple(struck.struck),
        )

    def _log_fault(self, made: Struck) -> None:
        until = None if made.span is None else made.at + made.span
        what = {"kind": made.kind, "device": made.device, "amount": made.amount}
        self._log.event(self._now(), "fault", **what, from_ns=made.at, until_ns=until)

    def _note_driver(self, client: int) -> None:
        """Note when the client began that drives them; others may join it, a guard for example."""
        if not self._drivers:
            self._began_at = self._now()
        self._drivers.add(client)


def line_of(lines: Mapping[str, T], name: str) -> T:
    """The line of that name. Raises the OSError of a device node that stands for nothing."""
    if name not in lines:
        raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
    return lines[name]
