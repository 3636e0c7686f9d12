"""Packets on the socket between served doubles and their clients.

The socket is a Unix socket of packets (SOCK_SEQPACKET). A packet is one question or one answer; it
arrives whole, in order, or not at all, so nothing has to be framed, and a client that is killed
leaves no half of a transaction behind. Inside is msgpack: `[number, [kind, ...]]`. An answer bears
the number of its question, so that one which comes too late is not taken for the next one's.
"""

from typing import Any, Final, TypeAlias

from msgspec import Struct
from msgspec.msgpack import Decoder, Encoder

from firmware_runtime.hal.strike import Kind, Place, Strike, Struck

LONGEST: Final = 1 << 18
"""Bytes of the longest packet; Linux carries no longer ones by default."""


class Transfer(Struct, tag="transfer", array_like=True, frozen=True):
    """One I2C transaction on a bus: bytes to write, numbers of bytes to read."""

    bus: str
    address: int
    messages: tuple[bytes | int, ...]


class Part(Struct, tag="part", array_like=True, frozen=True):
    """An I2C transaction whose messages have addresses of their own, or a piece of one.

    One that `holds` ends without STOP; one that `continues` goes on with what was held.
    """

    bus: str
    messages: tuple[tuple[int, bytes | int], ...]
    continues: bool
    holds: bool


class Write(Struct, tag="write", array_like=True, frozen=True):
    """Bytes for a serial port."""

    port: str
    data: bytes


class Read(Struct, tag="read", array_like=True, frozen=True):
    """Bytes that have arrived at a serial port."""

    port: str


class Enable(Struct, tag="enable", array_like=True, frozen=True):
    """Outputs let through or not, by the line at their chips; only while this client is there."""

    enabled: bool


class Look(Struct, tag="look", array_like=True, frozen=True):
    """Question for the state of the doubles."""


class Conclude(Struct, tag="conclude", array_like=True, frozen=True):
    """The result of a run of `elapsed` ns; `own` is what the robot itself knows about it."""

    elapsed: int
    own: dict[str, object]


class ListFaults(Struct, tag="list_faults", array_like=True, frozen=True):
    """Question for the faults that can be made, and those that were."""


class ClearFaults(Struct, tag="clear_faults", array_like=True, frozen=True):
    """Every fault that was made is to end."""


class Done(Struct, tag="done", array_like=True, frozen=True):
    """A transaction happened; `data` is what was read."""

    data: bytes


class Failed(Struct, tag="failed", array_like=True, frozen=True):
    """A transaction failed, with the errno that the adapter would report."""

    errno: int


class Refused(Struct, tag="refused", array_like=True, frozen=True):
    """Refusal of what was no question, or of a fault that cannot be made, and why."""

    reason: str


class Standing(Struct, tag="standing", array_like=True, frozen=True):
    """State of the doubles `at` ns after the server's start.

    `outputs` counts what is on, chip by chip; `levels` has every output, as the log does; `truth`
    has the true state of the world by ports of its probe, as far as the rig says it.
    """

    board: str
    at: int
    outputs: dict[str, int]
    levels: dict[str, float]
    truth: dict[str, Any] = {}


class Concluded(Struct, tag="concluded", array_like=True, frozen=True):
    """Result of a run, by the true state of the world."""

    result: dict[str, object]


class FaultList(Struct, tag="fault_list", array_like=True, frozen=True):
    """Faults of these doubles: those that can be made and where, and those that were made.

    Instants are ns after the server's start. A client that drives the doubles began at `began_at`,
    None if none has. `source` is the file of the board's settings, None for chips without one;
    `assignments` are the numbers of it that were overridden.
    """

    board: str
    source: str | None
    assignments: tuple[str, ...]
    at: int
    began_at: int | None
    kinds: tuple[Kind, ...]
    places: tuple[Place, ...]
    struck: tuple[Struck, ...]


FaultQuestion: TypeAlias = Strike | ListFaults | ClearFaults
"""Questions about faults: each is answered with the list as it is then, or refused."""
Asked: TypeAlias = Transfer | Part | Write | Read | Look | Conclude | Enable | FaultQuestion
Answered: TypeAlias = Done | Failed | Refused | Standing | Concluded | FaultList


class Question(Struct, array_like=True, frozen=True):
    """A packet from a client."""

    number: int
    asked: Asked


class Answer(Struct, array_like=True, frozen=True):
    """A packet from the server; number 0 answers what could not be read."""

    number: int
    answered: Answered


encode: Final = Encoder().encode
read_question: Final = Decoder(Question).decode
read_answer: Final = Decoder(Answer).decode
