"""The two lines of a bus double, byte by byte: START, address, bytes, repeated START, STOP.

Several targets may answer one address. SDA is a wired AND: one target that pulls it low
acknowledges for all, and bytes read from several at once are the bitwise AND. A target that refuses
a byte takes no further part until the next START.

What is written arrives when its message ends, what is read was so when its message began.
"""

import errno
import os
from collections.abc import Callable, Sequence
from functools import reduce
from operator import and_

from msgspec import Struct

from firmware_runtime.hal.budget import wire_ns
from firmware_runtime.hal.i2c import Message
from sim_doubles.clock import Now
from sim_doubles.i2c_target import AdapterProfile, Target


class BlockRead(int):
    """A read whose first byte is how many follow: an SMBus block. Its value is the bytes beside.

    1 is the length alone, 2 a packet error code too. Source: I2C_M_RECV_LEN of Linux.
    """


class Transaction(Struct, frozen=True):
    """One logged transaction: `answer` is what was read, `error` the errno it ended with."""

    at: int
    address: int
    messages: tuple[Message, ...]
    answer: bytes
    error: int | None

    @property
    def written(self) -> bytes:
        """The bytes the controller meant to write, joined."""
        return b"".join(message for message in self.messages if isinstance(message, bytes))

    @property
    def to_read(self) -> int:
        """The number of bytes the controller meant to read."""
        return sum(message for message in self.messages if isinstance(message, int))

    def __str__(self) -> str:
        """Direction and bytes in order, for people: `0x68 W 3a, R 01 02`."""
        parts, read = [], 0
        for message in self.messages:
            if isinstance(message, int):
                end = None if isinstance(message, BlockRead) else read + message
                parts.append(f"R {self.answer[read:end].hex(' ')}".rstrip())
                read += message
            else:
                parts.append(f"W {message.hex(' ')}".rstrip())
        ending = "" if self.error is None else f" -> errno {self.error}"
        return f"0x{self.address:02x} {', '.join(parts)}{ending}"


BITS_PER_BYTE = 9  # eight and the acknowledge
START_BITS = 1 + BITS_PER_BYTE  # with the address
LONGEST_BLOCK = 32  # of SMBus 2.0


class WireTiming:
    """Moves a clock on, by its `reach`, with the bits that go over a bus; without one, nothing."""

    def __init__(
        self, now: Now, reach: Callable[[int], None] | None, bus_hz: int, overhead_ns: int
    ) -> None:
        self._now = now
        self._reach = reach
        self._bus_hz = bus_hz
        self._overhead_ns = overhead_ns
        self._began_at = 0
        self._bits = 0

    def begin(self, at: int) -> None:
        """Let the adapter's overhead pass from `at`; the transaction begins on the wire."""
        self._bits = 0
        self._began_at = at + self._overhead_ns
        if self._overhead_ns and self._reach is not None:
            self._reach(self._began_at)

    def pause(self, span: int) -> None:
        """Let `span` ns pass between two transactions."""
        if self._reach is not None:
            self._reach(self._now() + span)

    def take(self, bits: int) -> None:
        """Let that many more bits of the transaction take their time."""
        reach = self._reach
        if reach is not None:
            self._bits += bits
            reach(self._began_at + wire_ns(self._bits, self._bus_hz))


class Wire:
    """Carries messages to targets, and reports what they refuse as a Linux adapter does.

    `bytes` (address bytes included) and `bits` count since construction.
    """

    def __init__(self, adapter: AdapterProfile, timing: WireTiming) -> None:
        self._adapter = adapter
        self._timing = timing
        self.bytes = 0
        self._conditions = 0

    @property
    def bits(self) -> int:
        """Bit times: 9 a byte, 1 each START, repeated START and STOP."""
        return BITS_PER_BYTE * self.bytes + self._conditions

    def _carry(
        self,
        at: int,
        targets: Sequence[Target],
        addresses: tuple[int, ...],
        messages: tuple[Message, ...],
        stop_bits: int,
    ) -> bytes:
        """Carry messages to their addresses; return what was read. `stop_bits`: 0 for no STOP.

        It is `at` now. Whatever goes wrong ends in a STOP.
        """
        answer = b""
        last = len(messages) - 1
        self._timing.begin(at)
        try:
            for index, message in enumerate(messages):
                ending = stop_bits if index == last else 0
                if isinstance(message, int):
                    answer += self._read(targets, addresses[index], message, ending)
                else:
                    self._write(targets, addresses[index], message, ending)
        except BaseException:
            self._stop(targets)
            raise
        if stop_bits:
            self._stop(targets)
        return answer

    def _start(self, targets: Sequence[Target], address: int, *, read: bool) -> list[Target]:
        self.bytes += 1
        self._conditions += 1
        answering = []
        for target in targets:
            if target.start(address, read=read):
                answering.append(target)  # noqa: PERF401 -- in CPython 3.11 sooner than a comprehension
        if not answering:
            self._timing.take(START_BITS + 1)
            raise os_error(self._adapter.address_refused)
        return answering

    def _write(
        self, targets: Sequence[Target], address: int, message: bytes, stop_bits: int
    ) -> None:
        answering = self._start(targets, address, read=False)
        length = len(message)
        self._timing.take(START_BITS + BITS_PER_BYTE * length + stop_bits)
        if len(answering) == 1:
            refused = answering[0].write_bytes(message)
        else:
            refused = _first_refused(answering, message)
        if refused is not None:
            self.bytes += refused + 1
            raise os_error(self._adapter.byte_refused)
        self.bytes += length

    def _read(self, targets: Sequence[Target], address: int, length: int, stop_bits: int) -> bytes:
        answering = self._start(targets, address, read=True)
        if isinstance(length, BlockRead):
            answer = self._read_block(answering, length)
        else:
            self.bytes += length
            answer = _read_from(answering, length)
        self._timing.take(START_BITS + BITS_PER_BYTE * len(answer) + stop_bits)
        return answer

    def _read_block(self, answering: list[Target], beside: BlockRead) -> bytes:
        self.bytes += 1
        first = _read_from(answering, 1)
        if not 1 <= first[0] <= LONGEST_BLOCK:
            raise os_error(errno.EPROTO)
        rest = first[0] + beside - 1
        self.bytes += rest
        return first + _read_from(answering, rest)

    def _stop(self, targets: Sequence[Target]) -> None:
        self._conditions += 1
        for target in targets:
            target.stop()


def _read_from(answering: list[Target], length: int) -> bytes:
    """Read bytes; those of several targets at once are the bitwise AND."""
    if len(answering) == 1:
        return answering[0].read_bytes(length)
    colliding = ([target.read() for target in answering] for _ in range(length))
    return bytes([reduce(and_, driven) for driven in colliding])


def _first_refused(targets: list[Target], message: bytes) -> int | None:
    """Deliver bytes until no target acknowledges one; return its index, None if all went."""
    for index, byte in enumerate(message):
        targets = [target for target in targets if target.write(byte)]
        if not targets:
            return index
    return None


def os_error(number: int) -> OSError:
    """Build the error a failed system call raises; 110 makes it a TimeoutError."""
    return OSError(number, os.strerror(number))
