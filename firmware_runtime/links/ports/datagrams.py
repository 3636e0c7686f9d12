"""Datagrams to a running robot: one JSON object a message.

    {"port": "yaw_reference", "value": 1.0}            put a value into an input port of the model
    {"port": "yaw_reference", "value": 1.0, "confirm": true}   the same, answered when it is in
    {"watch": ["imu.sample", "esc.fault"], "every": 10}  send every tenth message of output ports
    {"watch": []}                                      send none any more
    {"list": true}                                     which ports there are, and what was counted
    {"time": true}                                     the run's time and the machine's, now
    {"request": "arm", "lease_s": 0.4}                 something that the run does (`control`)

A value that has waited for more than 2 s, as where the run stood still, is refused.

Protocol without I/O: bytes in, a request or a Refusal out.
"""

from typing import Annotated, Any, Final, TypeAlias

import msgspec
from msgspec import Meta, Raw, Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.statistics.json_values import NOT_JSON, plain


class Refusal(FirmwareRuntimeError):
    """A datagram is not obeyed, and nothing else happens; the text goes back to its sender."""


LONGEST: Final = 1 << 14
"""Bytes of the longest message that is read."""
GREETING: Final = b'{"greets":"firmware-runtime"}'
"""What a run says first: it has taken the connection."""
MOST_PORTS: Final = 64
"""How many ports one sender may watch."""
LARGEST_EVERY: Final = 1_000_000
WATCHED_FOR: Final = 10 * SECOND
"""How long messages go to a watcher that does not ask again, ns."""
RENEW_EVERY: Final = 2 * SECOND
"""Ns from one request to watch to the next: a run that has just begun knows nothing of the last."""
TIMEOUT: Final = 2 * SECOND
"""Ns that a run has to answer; a value that has waited longer is refused."""


class Put(Struct, frozen=True, forbid_unknown_fields=True):
    """A value for an input port; how it is read depends on the port."""

    port: str
    value: Raw
    confirm: bool = False
    """Whether its sender wants an answer when it has arrived."""


class Watch(Struct, frozen=True, forbid_unknown_fields=True):
    """From now on, these output ports instead of those watched before; every N-th message only."""

    watch: Annotated[tuple[str, ...], Meta(max_length=MOST_PORTS)]
    every: Annotated[int, Meta(ge=1, le=LARGEST_EVERY)] = 1


class List(Struct, frozen=True, forbid_unknown_fields=True):
    """The question which ports there are."""

    list: bool


class Time(Struct, frozen=True, forbid_unknown_fields=True):
    """The question which instant of the run, and of the machine's monotonic clock, it is."""

    time: bool


class Ask(Struct, frozen=True):
    """A request to the run itself, and what was stated with it."""

    name: str
    stated: dict[str, Any]


Request: TypeAlias = Put | Watch | List | Time | Ask

_EXPECTED = "expected a JSON object with one of port, watch, list, time, request"
_asked = msgspec.json.Decoder(dict[str, Any]).decode
_keys = msgspec.json.Decoder(dict[str, Raw]).decode
_READERS: Final[dict[str, msgspec.json.Decoder[Put | Watch | List | Time]]] = {
    "port": msgspec.json.Decoder(Put),
    "watch": msgspec.json.Decoder(Watch),
    "list": msgspec.json.Decoder(List),
    "time": msgspec.json.Decoder(Time),
}
_encode = msgspec.json.Encoder().encode


def understood(datagram: bytes) -> Request:
    """Return what a datagram asks for. Raises Refusal."""
    if len(datagram) > LONGEST:
        raise Refusal("the datagram is too long", expected=f"{LONGEST} bytes at most")
    try:
        keys = _keys(datagram)
        for key, reader in _READERS.items():
            if key in keys:
                return reader.decode(datagram)
        if "request" in keys:
            return _ask_of(_asked(datagram))
    except NOT_JSON as error:
        raise Refusal(f"{error}; {_EXPECTED}") from error
    raise Refusal(f"the datagram asks for nothing known; {_EXPECTED}")


def _ask_of(said: dict[str, object]) -> Ask:
    name = said.pop("request")
    if not isinstance(name, str):
        raise Refusal(f"{name!r}: expected a name; {_EXPECTED}", where="request")
    return Ask(name, said)


def message_of(**what: object) -> bytes:
    """A message to a reader, its values as a trace shows them."""
    return _encode(plain(what))


class Said(Struct):
    """What a run says: an answer, or a message of a port that is watched."""

    error: str = ""
    taken: str = ""
    watching: tuple[str, ...] | None = None
    ports: tuple[dict[str, str], ...] | None = None
    port: str = ""
    t_ns: int = 0
    value: Any = None


said_in: Final = msgspec.json.Decoder(Said).decode
"""Reads what a run says. Raises MsgspecError."""
