"""Frames of a link, written byte by byte from docs/wire.md, and what their bodies may be."""

import hashlib
import hmac
import struct
from typing import Final, NamedTuple

HELLO, STEP, HEARTBEAT, BYE, REPORT = 1, 2, 3, 4, 5
HEADER: Final = 106
"""Bytes before the body."""
KEY: Final = hashlib.sha256(b"a key").digest()
OTHER_KEY: Final = hashlib.sha256(b"another key").digest()
NAN, INFINITY = float("nan"), float("inf")
YAW_LIMIT: Final = 1.0


class Fields(NamedTuple):
    """What a frame says, by the names of the document."""

    kind: int
    session: int
    peer: int
    counter: int
    sent_at: int
    echo: int = 0
    held: int = 0
    ports: int = 0
    origin: int = 0
    step: int = 0
    body: bytes = b""
    flags: int = 0
    missing_since: int = 0
    missing: int = 0
    missing_port: int = 0
    magic: bytes = b"FWL3"


def frame(fields: Fields, key: bytes | None = KEY) -> bytes:
    """The bytes of a frame; without a tag if there is no key."""
    plain = b"".join(
        (
            fields.magic,
            bytes((fields.kind, fields.flags)),
            fields.ports.to_bytes(2, "big"),
            fields.session.to_bytes(8, "big"),
            fields.peer.to_bytes(8, "big"),
            fields.counter.to_bytes(8, "big"),
            fields.sent_at.to_bytes(8, "big", signed=True),
            fields.echo.to_bytes(8, "big", signed=True),
            fields.held.to_bytes(8, "big", signed=True),
            bytes(16),
            fields.origin.to_bytes(8, "big", signed=True),
            fields.step.to_bytes(8, "big"),
            fields.missing_since.to_bytes(8, "big", signed=True),
            fields.missing.to_bytes(8, "big"),
            fields.missing_port.to_bytes(2, "big"),
            fields.body,
        )
    )
    return plain if key is None else plain + tag(plain, key)


def tag(plain: bytes, key: bytes = KEY) -> bytes:
    """The last 32 bytes."""
    return hmac.new(key, plain, hashlib.sha256).digest()


def fields_of(plain: bytes) -> Fields | None:
    """What the bytes of a frame say; None if they are none."""
    if len(plain) < HEADER or plain[:4] != b"FWL3":
        return None
    words = [int.from_bytes(plain[at : at + 8], "big") for at in range(8, 104, 8)]
    signed = [word - (1 << 64) if word >> 63 else word for word in words]
    found = Fields(
        kind=plain[4],
        flags=plain[5],
        ports=int.from_bytes(plain[6:8], "big"),
        session=words[0],
        peer=words[1],
        counter=words[2],
        sent_at=signed[3],
        echo=signed[4],
        held=signed[5],
        origin=signed[8],
        step=words[9],
        missing_since=signed[10],
        missing=words[11],
        missing_port=int.from_bytes(plain[104:106], "big"),
        body=plain[HEADER:],
    )
    is_sound = 1 <= found.kind <= 5 and found.flags == 0 and 0 not in (found.session, found.counter)
    return found if is_sound else None


# The body of a step ------------------------------------------------------------------------------


class Entry(NamedTuple):
    """What left by a port."""

    port: int
    sequence: int
    after: int
    values: bytes


def step(*entries: Entry) -> bytes:
    """The body of a step."""
    return b"".join(
        entry.port.to_bytes(2, "big")
        + entry.sequence.to_bytes(8, "big")
        + entry.after.to_bytes(8, "big")
        + len(entry.values).to_bytes(4, "big")
        + entry.values
        for entry in entries
    )


def entries_of(fields: Fields) -> list[Entry] | None:
    """What left by each port; None if that cannot be read."""
    found, rest = [], fields.body
    while rest:
        length = int.from_bytes(rest[18:22], "big")
        if len(rest) < 22 + length:
            return None
        port, sequence, after = (
            int.from_bytes(rest[begin:end], "big") for begin, end in ((0, 2), (2, 10), (10, 18))
        )
        found.append(Entry(port, sequence, after, rest[22 : 22 + length]))
        rest = rest[22 + length :]
    each_once = len({entry.port for entry in found}) == len(found) == fields.ports > 0
    return found if each_once and all(entry.after < entry.sequence for entry in found) else None


# Bodies, in MessagePack --------------------------------------------------------------------------


def number(value: float) -> bytes:
    """A float."""
    return b"\xcb" + struct.pack(">d", value)


def array(*parts: bytes) -> bytes:
    """An array of up to 15."""
    return bytes((0x90 + len(parts),)) + b"".join(parts)


def text(said: str) -> bytes:
    """A text of up to 31 bytes."""
    return bytes((0xA0 + len(said.encode()),)) + said.encode()


def extension(code: int, content: bytes) -> bytes:
    """An extension of up to 65535 bytes."""
    return b"\xc8" + len(content).to_bytes(2, "big") + bytes((code,)) + content


def hello(digest: bytes, leaving: bytes) -> bytes:
    """The body of a hello; `leaving` is an array."""
    binary = b"\xc4" + bytes((len(digest),)) + digest
    return array(binary, leaving, text("robot"), text("controller"), text("a machine"), b"\x00")


GOOD_BYE: Final = array(text("SIGTERM"), b"\xc2", b"\xc2")
BAD_BYES: Final = (b"", b"\xc0", array(text("over"), b"\xc3"), GOOD_BYE[:-1], GOOD_BYE + b"\x00")

MOTIONS: Final[dict[bytes, tuple[float, float]]] = {
    array(number(0.5), number(-1.25)): (0.5, -1.25),
    array(number(1e300), number(-0.0)): (1e300, -0.0),
    array(number(3.0), b"\x07"): (3.0, 7),
}
"""Values of the port `motion`, a named tuple of two floats, and what they are."""
TURNS: Final[dict[bytes, str]] = {text("left"): "left", text("stop"): "stop"}
"""Values of the port `turn`, which is ordered, and what they are."""
YAWS: Final[dict[bytes, float]] = {
    number(0.5): 0.5,
    number(-YAW_LIMIT): -YAW_LIMIT,
    b"\x01": 1,
}
"""Values of the port `yaw`, a float from -1 to 1."""

_DEEP: Final = b"\x91" * 5000 + b"\x00"
_MALFORMED: Final = (
    b"",
    b"\xc0",
    b"\xc1",
    text("0.5"),
    b"\x80",
    b"\xc4\x08" + bytes(8),
    number(0.5)[:-1],
    number(0.5) + b"\x00",
    _DEEP,
    extension(1, array(text("os:system"), text("reboot"))),
    extension(1, array(text("builtins:object"), b"\x90")),
    extension(1, b"\xc1"),
    extension(2, array(text("|O"), b"\x91\x01", b"\xc4\x08" + bytes(8))),
    extension(3, b"9" * 6000),
    extension(3, b"-"),
    extension(77, b""),
    b"\xdd\xff\xff\xff\xff",
    b"\xdb\xff\xff\xff\xff",
)
BAD_MOTIONS: Final[dict[bytes, str]] = {
    **dict.fromkeys(_MALFORMED, "malformed"),
    array(number(0.5)): "malformed",
    array(number(0.5), number(0.5), number(0.5)): "malformed",
    array(number(0.5), text("0")): "malformed",
    number(0.5): "malformed",
    array(number(NAN), number(0.5)): "not_finite",
    array(number(0.5), number(INFINITY)): "not_finite",
    array(number(-INFINITY), number(0.5)): "not_finite",
}
"""What the port `motion` refuses, and the reasons."""
BAD_YAWS: Final[dict[bytes, str]] = {
    **dict.fromkeys(_MALFORMED, "malformed"),
    array(number(0.5)): "malformed",
    number(NAN): "not_finite",
    number(INFINITY): "not_finite",
    b"\xca" + struct.pack(">f", -INFINITY): "not_finite",
    number(1.0000001): "out_of_limits",
    number(-1e300): "out_of_limits",
    b"\x02": "out_of_limits",
    b"\xcf" + b"\xff" * 8: "out_of_limits",
}
