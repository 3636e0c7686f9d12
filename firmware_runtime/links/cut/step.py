"""The body of a frame that bears a step: what left by each port, one after the other.

    port       2 bytes   its number in the cut
    sequence   8         of what left by this port in this session, rising from 1
    after      8         the sequence that has to enter before it; 0: any
    length     4         of what follows
    values               a MessagePack array of what left by the port in this step

Codec without I/O: bytes in, entries or Refused out.
"""

from collections.abc import Iterable, Iterator
from struct import Struct
from typing import Final, NamedTuple

from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.wire import Frame

_HEAD: Final = Struct("!HQQI")
HEAD: Final = _HEAD.size


class Entry(NamedTuple):
    """What left by one port in a step."""

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
    """What left by each port. Raises Refused."""
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
