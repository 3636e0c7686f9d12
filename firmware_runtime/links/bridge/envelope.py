"""Signed datagrams of the bridge: from whom, to whom, which in order, when, and the proof of it.

    fr1 ask SENDER RECEIVER COUNTER TIME MAC
    {"port": "yaw_reference", "value": 0.5}

What goes to the bridge is `ask`, what comes from it `answer`. SENDER and RECEIVER are 16
hexadecimal digits that a process draws when it begins; a receiver that is not known yet is all
zeros. COUNTER rises from each datagram of a sender to its next. TIME is the bridge's own clock in
ns, as far as the sender knows it. MAC is HMAC-SHA256 in hexadecimal digits, over the first line
without it and the space before it, the line's end, and the content.

Protocol without I/O: bytes in, an Envelope or a Refused out.
"""

import hmac
import re
from secrets import token_hex
from typing import Final, Literal, NamedTuple, TypeAlias

from firmware_runtime.errors import FirmwareRuntimeError

UNKNOWN: Final = "0" * 16
"""The receiver that a sender names which has had no message from any yet."""
LONGEST_HEAD: Final = 160
"""Bytes that a signature adds to a content at most."""
Direction: TypeAlias = Literal["ask", "answer"]

_LARGEST = (1 << 63) - 1
_HEAD = re.compile(
    rb"(fr1 (ask|answer) ([0-9a-f]{16}) ([0-9a-f]{16}) (0|[1-9][0-9]{0,18}) (0|[1-9][0-9]{0,18}))"
    rb" ([0-9a-f]{64})\n"
)


class Refused(FirmwareRuntimeError):
    """A datagram is not let in; `reason` is one word to count it by."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)


class Envelope(NamedTuple):
    """One datagram, with what its signature covers."""

    sender: str
    receiver: str
    counter: int
    at: int
    """Ns of the bridge's clock."""
    content: bytes


def new_name() -> str:
    """A name for a process that no other has; never UNKNOWN, but for one in 2 to the 64."""
    return token_hex(8)


def sealed(key: bytes, direction: Direction, envelope: Envelope) -> bytes:
    """The datagram that an envelope goes in."""
    sender, receiver, counter, at, content = envelope
    head = f"fr1 {direction} {sender} {receiver} {counter} {at}".encode()
    return head + b" " + _mac(key, head, content) + b"\n" + content


def opened(key: bytes, direction: Direction, datagram: bytes) -> Envelope:
    """Return what is in a datagram. Raises Refused: `malformed`, `forged` or `reflected`."""
    found = _HEAD.match(datagram)
    if found is None:
        raise Refused("malformed")
    head, way, sender, receiver, counter, at, mac = found.groups()
    content = datagram[found.end() :]
    if not hmac.compare_digest(mac, _mac(key, head, content)):
        raise Refused("forged")
    if way != direction.encode():
        raise Refused("reflected")
    envelope = Envelope(sender.decode(), receiver.decode(), int(counter), int(at), content)
    if max(envelope.counter, envelope.at) > _LARGEST:
        raise Refused("malformed")
    return envelope


def _mac(key: bytes, head: bytes, content: bytes) -> bytes:
    return hmac.digest(key, head + b"\n" + content, "sha256").hex().encode()
