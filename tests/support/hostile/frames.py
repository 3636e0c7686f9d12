"""Frames of a link, written byte by byte from docs/wire.md, and what their bodies may be."""

import hashlib
import hmac
import struct
from typing import Final, NamedTuple

HELLO, STEP, HEARTBEAT, BYE, REPORT = 1, 2, 3, 4, 5
_HEAD: Final = struct.Struct(">4sBBHQQQqqqQQqQqQH")
_ENTRY: Final = struct.Struct(">HQQI")
HEADER: Final = 106
"""Bytes before the body."""
KEY: Final = hashlib.sha256(b"a key").digest()
OTHER_KEY: Final = hashlib.sha256(b"another key").digest()
NAN, INFINITY = float("nan"), float("inf")
YAW_LIMIT: Final = 1.0


class Fields(NamedTuple):
    """What a frame says, by the names of the document, in its order."""

    kind: int
    session: int
    peer: int
    counter: int
    sent_at: int
    echo: int = 0
    held: int = 0
    seen: int = 0
    seen_before: int = 0
    origin: int = 0
    step: int = 0
    missing_since: int = 0
    missing: int = 0
    missing_port: int = 0
    ports: int = 0
    body: bytes = b""
    flags: int = 0
    magic: bytes = b"FWL3"


def frame(fields: Fields, key: bytes | None = KEY) -> bytes:
    """The bytes of a frame; without a tag if there is no key."""
    head = fields.magic, fields.kind, fields.flags, fields.ports
    plain = _HEAD.pack(*head, *fields[1:14]) + fields.body
    return plain if key is None else plain + tag(plain, key)


def tag(plain: bytes, key: bytes = KEY) -> bytes:
    """The last 32 bytes."""
    return hmac.new(key, plain, hashlib.sha256).digest()


def fields_of(plain: bytes) -> Fields | None:
    """What the bytes of a frame say; None if they are none."""
    if len(plain) < HEADER or plain[:4] != b"FWL3":
        return None
    magic, kind, flags, ports, *numbers = _HEAD.unpack_from(plain)
    found = Fields(kind, *numbers)._replace(
        ports=ports, body=plain[HEADER:], flags=flags, magic=magic
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
    return b"".join(_ENTRY.pack(*entry[:3], len(entry.values)) + entry.values for entry in entries)


def entries_of(fields: Fields) -> list[Entry] | None:
    """What left by each port; None if that cannot be read."""
    found, rest = [], fields.body
    while rest:
        if len(rest) < _ENTRY.size:
            return None
        port, sequence, after, length = _ENTRY.unpack_from(rest)
        values, rest = rest[_ENTRY.size :][:length], rest[_ENTRY.size + length :]
        if len(values) < length:
            return None
        found.append(Entry(port, sequence, after, values))
    each_once = len({entry.port for entry in found}) == len(found) == fields.ports > 0
    return found if each_once and all(entry.after < entry.sequence for entry in found) else None


# Bodies, in MessagePack --------------------------------------------------------------------------


def pack(value: object) -> bytes:
    """MessagePack, as far as a link takes it here."""
    match value:
        case bool() | None:
            return {None: b"\xc0", False: b"\xc2", True: b"\xc3"}[value]
        case float():
            return b"\xcb" + struct.pack(">d", value)
        case int() if 0 <= value < 128:
            return bytes([value])
        case str() if len(value) < 32:
            return bytes([0xA0 | len(value)]) + value.encode()
        case bytes():
            return b"\xc4" + bytes([len(value)]) + value
        case list():
            return array(*map(pack, value))
    raise TypeError(value)


def array(*parts: bytes) -> bytes:
    """An array of up to 15, of what is packed."""
    return bytes((0x90 + len(parts),)) + b"".join(parts)


def extension(code: int, content: bytes) -> bytes:
    """An extension of up to 65535 bytes."""
    return b"\xc8" + len(content).to_bytes(2, "big") + bytes((code,)) + content


def hello(digest: bytes, leaving: list[int]) -> bytes:
    """The body of a hello."""
    return pack([digest, leaving, "robot", "controller", "a machine", 0])


GOOD_BYE: Final = pack(["SIGTERM", False, False])
BAD_BYES: Final = (b"", b"\xc0", pack(["over", True]), GOOD_BYE[:-1], GOOD_BYE + b"\x00")

MOTIONS: Final[dict[bytes, tuple[float, float]]] = {
    array(pack(0.5), pack(-1.25)): (0.5, -1.25),
    array(pack(1e300), pack(-0.0)): (1e300, -0.0),
    array(pack(3.0), b"\x07"): (3.0, 7),
}
"""Values of the port `motion`, a named tuple of two floats, and what they are."""
TURNS: Final[dict[bytes, str]] = {pack("left"): "left", pack("stop"): "stop"}
"""Values of the port `turn`, which is ordered, and what they are."""
YAWS: Final[dict[bytes, float]] = {
    pack(0.5): 0.5,
    pack(-YAW_LIMIT): -YAW_LIMIT,
    b"\x01": 1,
}
"""Values of the port `yaw`, a float from -1 to 1."""

_DEEP: Final = b"\x91" * 5000 + b"\x00"
_MALFORMED: Final = (
    b"",
    b"\xc0",
    b"\xc1",
    pack("0.5"),
    b"\x80",
    b"\xc4\x08" + bytes(8),
    pack(0.5)[:-1],
    pack(0.5) + b"\x00",
    _DEEP,
    extension(1, array(pack("os:system"), pack("reboot"))),
    extension(1, array(pack("builtins:object"), b"\x90")),
    extension(1, b"\xc1"),
    extension(2, array(pack("|O"), b"\x91\x01", b"\xc4\x08" + bytes(8))),
    extension(3, b"9" * 6000),
    extension(3, b"-"),
    extension(77, b""),
    b"\xdd\xff\xff\xff\xff",
    b"\xdb\xff\xff\xff\xff",
)
BAD_MOTIONS: Final[dict[bytes, str]] = {
    **dict.fromkeys(_MALFORMED, "malformed"),
    array(pack(0.5)): "malformed",
    array(pack(0.5), pack(0.5), pack(0.5)): "malformed",
    array(pack(0.5), pack("0")): "malformed",
    pack(0.5): "malformed",
    array(pack(NAN), pack(0.5)): "not_finite",
    array(pack(0.5), pack(INFINITY)): "not_finite",
    array(pack(-INFINITY), pack(0.5)): "not_finite",
}
"""What the port `motion` refuses, and the reasons."""
BAD_YAWS: Final[dict[bytes, str]] = {
    **dict.fromkeys(_MALFORMED, "malformed"),
    array(pack(0.5)): "malformed",
    pack(NAN): "not_finite",
    pack(INFINITY): "not_finite",
    b"\xca" + struct.pack(">f", -INFINITY): "not_finite",
    pack(1.0000001): "out_of_limits",
    pack(-1e300): "out_of_limits",
    b"\x02": "out_of_limits",
    b"\xcf" + b"\xff" * 8: "out_of_limits",
}
