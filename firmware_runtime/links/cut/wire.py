"""The frame of a link: what two runs say to each other, one datagram each (docs/wire.md).

A header of 106 bytes, the body, and, where there is a key, HMAC-SHA256 over both. Whole numbers are
big-endian; instants are CLOCK_MONOTONIC of the machine that is named, in ns. The body of a hello or
a bye is MessagePack; that of a step has an entry for each port by which something left:

    port       2 bytes   its number in the cut
    sequence   8         of what left by this port in this session, rising from 1
    after      8         the sequence that has to enter before it; 0: any
    length     4         of what follows
    values               a MessagePack array of what left by the port in this step

Codec without I/O: bytes in, a frame, entries or Refused out.
"""

import hmac
from collections.abc import Callable, Iterable, Iterator
from enum import IntEnum
from hashlib import sha256
from struct import Struct
from typing import Final, NamedTuple, TypeVar

import msgspec

from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.statistics.json_values import NOT_JSON

MAGIC: Final = b"FWL3"
LONGEST: Final = 60 * 1024
"""Bytes of the longest frame, its authentication code included."""
TAG: Final = sha256().digest_size
_HEADER: Final = Struct("!4sBBHQQQqqqQQqQqQH")
HEADER: Final = _HEADER.size
LONGEST_BODY: Final = LONGEST - HEADER - TAG


class Kind(IntEnum):
    """Kind of a frame."""

    HELLO = 1
    """Which cut this end belongs to; the body says it (`Greeting`)."""
    STEP = 2
    """The values that left the model in one step; the body has them by port (`body_of`)."""
    HEARTBEAT = 3
    """A sign of life, and what has arrived."""
    BYE = 4
    """This end ends; the body says why."""
    REPORT = 5
    """What a carrier has counted; between a run and its own carrier only, never on the network."""


class Missing(NamedTuple):
    """Value that the receiver is not known to have, by one port; none if the sequence is 0."""

    since: int
    """When the first of it left its model, by the sender's clock."""
    sequence: int
    """Of that."""
    port: int


NOTHING_MISSING: Final = Missing(0, 0, 0)


class Frame(NamedTuple):
    """One frame. `ports`, `origin` and `step` have a meaning in steps only."""

    kind: Kind
    session: int
    """Of the sender: 64 random bits, drawn when it starts."""
    peer: int
    """The session of the receiver, as far as the sender knows it; 0 if it does not."""
    counter: int
    """Of the sender's frames in this session, rising from 1."""
    sent_at: int
    """By the sender's clock."""
    echo: int = 0
    """`sent_at` of the latest frame that the sender accepted; 0: none yet."""
    held: int = 0
    """Ns that the sender had that frame before it sent this one."""
    seen: int = 0
    """The highest counter that the sender has accepted; 0: none yet."""
    seen_before: int = 0
    """Bit n: the frame with the counter `seen` - 1 - n has been accepted, too."""
    ports: int = 0
    """By how many ports values left."""
    origin: int = 0
    """The instant at which they left their model, by the sender's clock."""
    step: int = 0
    """Of the steps in which values left, rising from 1; what is sent again keeps its own."""
    missing: Missing = NOTHING_MISSING
    """What the receiver is not known to have for longest; in steps and heartbeats."""
    body: bytes = b""


def encoded(frame: Frame, key: bytes | None = None) -> bytes:
    """The bytes of a frame, with its authentication code if there is a key."""
    numbers = (*frame[1:9], *frame[10:12], *frame.missing)
    plain = _HEADER.pack(MAGIC, frame.kind, 0, frame.ports, *numbers) + frame.body
    return sealed(plain, key) if key is not None else plain


def sealed(plain: bytes, key: bytes) -> bytes:
    """A frame and its authentication code."""
    return plain + hmac.digest(key, plain, "sha256")


def opened(datagram: bytes, key: bytes) -> bytes:
    """A frame without its authentication code. Raises Refused unless the key has made that."""
    if len(datagram) > LONGEST:
        raise Refused(Reason.OVERSIZED, f"over {LONGEST} bytes")
    plain, tag = datagram[:-TAG], datagram[-TAG:]
    if not hmac.compare_digest(hmac.digest(key, plain, "sha256"), tag):
        raise Refused(Reason.FORGED)
    return plain


def decoded(plain: bytes) -> Frame:
    """The frame of bytes without authentication code. Raises Refused."""
    if len(plain) > LONGEST:
        raise Refused(Reason.OVERSIZED, f"over {LONGEST} bytes")
    if len(plain) < HEADER or plain[:4] != MAGIC:
        raise Refused(Reason.MALFORMED, "no frame of this format")
    _, kind, flags, ports, *numbers = _HEADER.unpack_from(plain)
    if not Kind.HELLO <= kind <= Kind.REPORT or flags != 0:
        raise Refused(Reason.MALFORMED, f"kind {kind}, flags {flags}")
    missing, body = Missing._make(numbers[10:]), plain[HEADER:]
    frame = Frame._make((_KINDS[kind], *numbers[:8], ports, *numbers[8:10], missing, body))
    if frame.session == 0 or frame.counter == 0:
        raise Refused(Reason.MALFORMED, "no session, or no counter")
    return frame


_KINDS: Final = {kind.value: kind for kind in Kind}


_HEAD: Final = Struct("!HQQI")
HEAD: Final = _HEAD.size


class Entry(NamedTuple):
    """Values that left by one port in a step."""

    port: int
    sequence: int
    after: int
    body: bytes


def body_of(entries: Iterable[Entry]) -> bytes:
    """The body of a frame with these."""
    return b"".join(
        part
        for port, sequence, after, body in entries
        for part in (_HEAD.pack(port, sequence, after, len(body)), body)
    )


def entries_of(frame: Frame) -> list[Entry]:
    """Return what left by each port. Raises Refused."""
    found = list(_entries(frame.body))
    if len(found) != frame.ports or len({entry.port for entry in found}) != len(found):
        raise Refused(Reason.MALFORMED, f"{len(found)} entries; expected {frame.ports} ports")
    if not found:
        raise Refused(Reason.MALFORMED, "a step in which nothing left")
    return found


def _entries(body: bytes) -> Iterator[Entry]:
    at = 0
    while at < len(body):
        if at + HEAD > len(body):
            raise Refused(Reason.MALFORMED, "an entry that is cut off")
        port, sequence, after, length = _HEAD.unpack_from(body, at)
        at += HEAD + length
        if at > len(body) or not 0 <= after < sequence:
            raise Refused(Reason.MALFORMED, "an entry that is cut off, or in no order")
        yield Entry(port, sequence, after, body[at - length : at])


BYES: Final = 3
"""How often an end says its bye: one may be lost."""


class Greeting(msgspec.Struct, frozen=True, array_like=True):
    """The body of a hello, in MessagePack: an array of these, in order."""

    digest: bytes
    """SHA-256 over the names and types of all ports of the cut, in order of their numbers."""
    leaving: tuple[int, ...]
    """Numbers of the ports that this end sends."""
    board: str
    role: str
    machine: str
    """The boot of the machine, so that ends on one machine know it; empty where it is not shown."""
    started_at: int
    """Instant 0 of the run, by the sender's clock."""
    is_taken: bool = False
    """Whether the sender has another peer, which is not silent."""


class Farewell(msgspec.Struct, frozen=True, array_like=True):
    """The body of a bye."""

    reason: str
    is_over: bool
    """Whether the task is over, so that the other end is to end too; otherwise it waits."""
    failed: bool


encode = msgspec.msgpack.Encoder().encode
T = TypeVar("T")


def reading(kind: type[T]) -> Callable[[bytes], T]:
    """Return what reads the body of a frame as this; it raises Refused."""
    decode = msgspec.msgpack.Decoder(kind).decode

    def read(body: bytes) -> T:
        try:
            return decode(body)
        except NOT_JSON as error:
            raise Refused(Reason.MALFORMED, str(error)) from error

    return read


greeting_of: Final = reading(Greeting)
farewell_of: Final = reading(Farewell)
