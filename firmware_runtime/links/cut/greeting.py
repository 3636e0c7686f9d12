"""What an end says of itself in a hello: which cut it belongs to, and which side of it it is."""

from typing import Final

import msgspec

from firmware_runtime.links.cut.refusal import Reason, Refused

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
_greeting = msgspec.msgpack.Decoder(Greeting).decode
_farewell = msgspec.msgpack.Decoder(Farewell).decode


def greeting_of(body: bytes) -> Greeting:
    """What a hello says. Raises Refused."""
    try:
        return _greeting(body)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise Refused(Reason.MALFORMED, str(error)) from error


def farewell_of(body: bytes) -> Farewell:
    """What a bye says. Raises Refused."""
    try:
        return _farewell(body)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise Refused(Reason.MALFORMED, str(error)) from error
