"""Sections: what entered during one stretch of a run that computes without a pause.

A section is MessagePack: an array of the fields of `Section`. Within each list things stand in the
order in which they came, so a replay that asks for the same, in the same order, gets the same.
"""

from collections.abc import Callable, Iterable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import msgspec

from firmware_runtime.devs.ports import Sent
from firmware_runtime.errors import ConfigError, legible, text_of
from firmware_runtime.recording.values import UnknownValue, decoded, encoded, plain


class Kind(IntEnum):
    """What a run did in a section."""

    HEADER = 0
    """Nothing: `extra` is the recording's header, which stands first in every chunk."""
    BUILD = 1
    """It put the robot together."""
    PROBE = 2
    """It asked each chip who it is, before the run: at instant 0, whatever is in the file."""
    GO_ON = 3
    """It began or went on; `at` is the instant it goes on to."""
    STEP = 4
    """It worked off the instant `at`."""
    SAFE = 5
    """It switched its outputs off, between two steps."""
    RETUNED = 6
    """It took up the settings in `extra`."""
    ARMED = 7
    """Its outputs were enabled (`extra` true) or disabled."""
    EXIT = 8
    """Its models exited."""
    ENDED = 9
    """It was over: `extra` is its state, its reason, and the counts of its models."""
    KEYFRAME = 10
    """`extra` is the state of the whole robot, as bytes."""
    OUTSIDE = 11
    """Something else used the lines, such as a check before arming; it is not run again."""
    LOST = 12
    """A section could not be written; `extra` is why. What follows begins at a keyframe."""
    CLASSES = 13
    """It did nothing: `extra` is `NotedClasses.state`, which stands behind each keyframe."""
    DATE = 14
    """It did nothing: `extra` is CLOCK_MONOTONIC and the system's time at the instant `at`, ns."""


if TYPE_CHECKING:
    Messages: TypeAlias = Any
    Answer: TypeAlias = Any
else:  # of a file anything else is refused when it is read
    Messages = list[int | bytes] | bytes
    Answer = bytes | tuple[str, str]


class Transfer(msgspec.Struct, array_like=True, frozen=True):
    """One transfer: a transaction on a bus, or a use of a serial port."""

    line: int
    """Place in the header's `lines`."""
    address: int
    """Of the device, 7 bits; of a port what was done: `WRITE`, `READ` or `DISCARD`."""
    messages: Messages
    """As `hal.i2c.Message`, a list; bytes for a port."""
    answer: Answer
    """What was read; name and sentence of the error if it failed."""
    at: int
    """When it had ended, ns since the start of the run; 0 for one before it."""

    @property
    def failed(self) -> bool:
        """Whether it ended with an error."""
        return not isinstance(self.answer, bytes)

    @property
    def is_one(self) -> bool:
        """Whether it is one that a line can have had."""
        if self.line < 0 or not DISCARD <= self.address < _ADDRESSES:
            return False
        if self.address < 0:
            return isinstance(self.messages, bytes)
        return isinstance(self.messages, list) and all(map(_is_message, self.messages))


def _is_message(message: object) -> bool:
    return isinstance(message, bytes) or (type(message) is int and 0 <= message <= _LONGEST)


_ADDRESSES: Final = 128
_LONGEST: Final = 1 << 16
"""Bytes of one message that are read, more than a bus takes."""


WRITE: Final = -1
READ: Final = -2
DISCARD: Final = -3


class Section(msgspec.Struct, array_like=True):
    """See the module; lists that are empty at the end are still written."""

    kind: Kind
    at: int
    """Instant of the run, ns."""
    readings: list[int]
    """What the clock said, instants of the run in ns; none in virtual time."""
    times: list[int]
    """What the lines said of their own time."""
    enabled: list[bool]
    """Whether outputs were enabled, as often as a driver asked."""
    world: list[int]
    """Of models that are not the robot's own: how many values they sent, and time advances."""
    sent: msgspec.Raw
    """Number of an output port and value, in turns, for all that was sent."""
    transfers: list[Transfer]
    entered: list[tuple[str, Any]]
    """Input port of the root model and value, as `recording.values.plain` has it."""
    extra: Any = None
    """What the kind says; of a step what `NotedClasses.note` found in what was sent, or None."""

    @property
    def has_instant(self) -> bool:
        """Whether `at` is when it was: not of a header, nor of how far the run is to go."""
        return self.kind not in _WITHOUT_INSTANT


class _UpToSent(msgspec.Struct, array_like=True, frozen=True, gc=False):
    """The first fields of a section, up to what was sent: read in a third of the time."""

    kind: int
    at: int
    readings: msgspec.Raw
    times: msgspec.Raw
    enabled: msgspec.Raw
    world: msgspec.Raw
    sent: list[Any]


class Timed(msgspec.Struct, array_like=True, frozen=True, gc=False):
    """The first two fields of a section."""

    kind: int
    at: int


_WITHOUT_INSTANT: Final = frozenset({Kind.HEADER, Kind.GO_ON})
_UNKNOWN: Final = "unknown"


def _in_words(value: object) -> object:
    """What stands for a value that MessagePack has no words for."""
    try:
        return plain(value)
    except UnknownValue:
        return _unknown(value)


def _unknown(value: object) -> dict[str, str]:
    """What is known of a value that cannot be written: its class."""
    kind = type(value)
    return {_UNKNOWN: f"{kind.__module__}:{kind.__qualname__}"}


_ENCODER: Final = msgspec.msgpack.Encoder(enc_hook=_in_words)
encode: Final[Callable[[Any], bytes]] = _ENCODER.encode
"""The fields of a section, in their order, or a value, as bytes.

Raises an exception where something cannot be written, such as a text that UTF-8 has not.
"""
encode_into: Final[Callable[[Any, bytearray], None]] = _ENCODER.encode_into
"""As `encode`, in place of what is in an array of bytes."""
_UNKNOWN_KEY: Final = encode(_UNKNOWN)
_decode: Final = msgspec.msgpack.Decoder(Section).decode
_decode_up_to_sent: Final = msgspec.msgpack.Decoder(_UpToSent).decode
timed: Final[Callable[[bytes], Timed]] = msgspec.msgpack.Decoder(Timed).decode
"""Kind and instant of a section that has been found to be one."""
_SENT: Final = msgspec.msgpack.Decoder(list[Any]).decode


def encode_in_words(fields: Sequence[Any]) -> bytes:
    """As `encode`, but a value that was sent and cannot be written is said to be unknown."""
    kind, at, readings, times, enabled, world, sent, transfers, entered, extra = fields
    values = _each(sent)
    return encode((kind, at, readings, times, enabled, world, values, transfers, entered, extra))


def encode_sent(sent: Sent) -> bytes:
    """What was sent in a section, as its bytes have it."""
    try:
        return encode(sent)
    except Exception:  # noqa: BLE001 -- a value of the model's, whatever it is
        return encode(_each(sent))


def count_of_unknown(section: Section) -> int:
    """How many of the values that were sent are recorded by a class, whole or in part."""
    if _UNKNOWN_KEY not in bytes(section.sent):
        return 0
    return sum(_has_unknown(form) for _, form in sent_of(section))


def _has_unknown(form: object) -> bool:
    if isinstance(form, list):
        return any(map(_has_unknown, form))
    if not isinstance(form, dict):
        return False
    is_one = form.keys() == {_UNKNOWN} and isinstance(form[_UNKNOWN], str)
    return is_one or any(map(_has_unknown, form.values()))


def sentences(errors: Iterable[Exception]) -> list[str]:
    """What models raised when they exited, as a recording has it."""
    return [legible(f"{type(each).__name__}: {text_of(each)}") for each in errors]


def decode(content: bytes) -> Section:
    """A section of its bytes. Raises msgspec.MsgspecError for what is none.

    Before the run the clock counts from another moment; the run's start sets it again.
    """
    section: Section = decoded(_decode, content)
    if section.kind is Kind.PROBE:
        section.at = 0
        section.transfers = [msgspec.structs.replace(each, at=0) for each in section.transfers]
    return section


def sent_in(content: bytes) -> Iterable[tuple[int, Any]]:
    """As `sent_of`, of the bytes of a section that has been found to be one. Raises ConfigError."""
    try:
        sent = _decode_up_to_sent(content).sent
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise _unreadable(text_of(error)) from error
    numbers = sent[::2]
    if len(sent) % 2 or not all(type(number) is int for number in numbers):
        raise _unreadable("a port without a value, or that is no number")
    return zip(numbers, sent[1::2], strict=True)


def sent_of(section: Section) -> list[tuple[int, Any]]:
    """Number of the port and value, for all that was sent. Raises ConfigError."""
    try:
        found = pairs_of(_SENT(bytes(section.sent)))
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise _unreadable(str(error)) from error
    if not all(type(number) is int for number, _ in found):
        raise _unreadable("a port that is no number")
    return found


def pairs_of(sent: Sent) -> list[tuple[int, Any]]:
    """Number and value in pairs. Raises ValueError for a number without a value."""
    if len(sent) % 2 != 0:
        raise ValueError("a port without a value")
    return list(zip(sent[::2], sent[1::2], strict=True))


def _unreadable(why: str) -> ConfigError:
    fault = f"values of a section cannot be read ({why}); expected ports and values in turns"
    return ConfigError.of_one("recording", fault)


def _each(sent: Sent) -> Sent:
    """Values each on their own: one that cannot be written does not take the others with it."""
    found: Sent = []
    for number, value in pairs_of(sent):
        found += number, msgspec.Raw(_on_its_own(value))
    return found


def _on_its_own(value: object) -> bytes:
    """A value as it would be among others; else in words, such as a number of over 64 bits."""
    for encoder in (encode, encoded):
        try:
            return encoder(value)
        except Exception:  # noqa: BLE001, S112 -- a value of the model's, whatever it is
            continue
    return encode(_unknown(value))
