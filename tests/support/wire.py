"""Lines as the log of a bus has them, carried out and compared: how tests of a chip's double read.

`W 0a 10` writes; `W 02, R 01` writes, reads after a repeated START and compares; `00*6` is six
bytes. `0x70 W 00` is for another address; `W 00, R 48 -> refused` is not acknowledged. `7.2 ms` is
a wait and `power cycle` one of the bus; `running is True` or `duties is 1 0*15` compares a figure
of the rig or of its chip. `warns TEXT` is in the next warning of the chip; in the end there are no
others. Semicolons separate lines.
"""

import ast
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Generic, Protocol, TypeVar

import pytest
from firmware_drivers.chips.step import Step

from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target

UNITS = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000}
_WAIT = re.compile(r"([\d.]+) (ns|us|ms|s)")
_FIGURE = re.compile(r"(\w+) is (.+)")


def take(clock: ManualClock, steps: Iterable[Step]) -> None:
    """Take steps of a bring-up or a measurement, each with its wait."""
    for step in steps:
        step.action()
        clock.advance(step.wait_ns)


class Warned(Protocol):
    """A double of a chip, as far as every test needs it."""

    @property
    def warnings(self) -> list[str]:
        """What it objects to."""


C = TypeVar("C", bound=Warned)


class Played(Generic[C]):
    """A chip and the clock that its test moves; a subclass says what else a line may be."""

    def __init__(self, clock: ManualClock, chip: C) -> None:
        self.clock = clock
        self.chip = chip
        self._warned = 0

    def wait(self, milliseconds: float) -> None:
        self.clock.advance(round(milliseconds * UNITS["ms"]))

    def take(self, steps: Iterable[Step]) -> None:
        take(self.clock, steps)

    def power_cycle(self) -> None:
        raise NotImplementedError

    def transfer(self, line: str) -> None:
        raise NotImplementedError

    def play(self, *lines: str) -> None:
        """Carry out the lines; an AssertionError says which of them ended otherwise."""
        for line in "; ".join(lines).split("; "):
            self._step(line)
        others = self.chip.warnings[self._warned :]
        assert not others, others

    def _step(self, line: str) -> None:
        wait, figure = _WAIT.fullmatch(line), _FIGURE.fullmatch(line)
        if wait:
            self.clock.advance(round(float(wait[1]) * UNITS[wait[2]]))
        elif line.startswith("warns "):
            others = self.chip.warnings[self._warned :]
            assert line.removeprefix("warns ") in "".join(others[:1]), (line, others)
            self._warned += 1
        elif figure:
            holder = self.chip if hasattr(self.chip, figure[1]) else self
            found = getattr(holder, figure[1])
            expected = _value(figure[2])
            is_near = isinstance(expected, float | tuple)
            assert found == (pytest.approx(expected) if is_near else expected), (line, found)
        elif line == "power cycle":
            self.power_cycle()
        else:
            self.transfer(line)


class WiredChip(Played[C]):
    """A chip's double on an I2C bus of its own."""

    def __init__(
        self, clock: ManualClock, chip: C, address: int, targets: Sequence[Target]
    ) -> None:
        super().__init__(clock, chip)
        self.address = address
        self.bus = I2cBusDouble("i2c-1", clock, targets)

    def write(self, register: int, *content: int) -> None:
        self.bus.write(self.address, bytes((register, *content)))

    def read(self, register: int, length: int = 1) -> bytes:
        return self.bus.write_read(self.address, bytes((register,)), length)

    def sent(self) -> list[str]:
        """Return what went over the bus since the last call, without the chip's own address."""
        lines = [str(each).removeprefix(f"0x{self.address:02x} ") for each in self.bus.log]
        self.bus.log.clear()
        return lines

    def power_cycle(self) -> None:
        self.bus.power_cycle()

    def transfer(self, line: str) -> None:
        request, _, end = line.partition(" -> ")
        address = self.address
        if request.startswith("0x"):
            number, _, request = request.partition(" ")
            address = int(number, 16)
        written, _, read = request.partition("R")
        expected = _data(read)
        messages: list[Message] = [_data(written.strip("W, "))] if "W" in written else []
        messages += [len(expected)] if expected else []
        if end == "refused":
            with pytest.raises(NoAcknowledge):
                self.bus.transaction(address, messages)
            return
        found = self.bus.transaction(address, messages)
        assert found == expected, f"{line}: read {found.hex(' ')}"


def _value(text: str) -> object:
    if text[0] in "[(" or not set("* ") & set(text):
        return ast.literal_eval(text)
    runs = (each.partition("*") for each in text.split())
    return tuple(float(one) for one, _, times in runs for _ in range(int(times or 1)))


def _data(text: str) -> bytes:
    runs = (each.partition("*") for each in text.split())
    return b"".join(bytes.fromhex(byte) * int(times or 1) for byte, _, times in runs)


def sentences(table: Mapping[str, str]) -> pytest.MarkDecorator:
    """Make a test of each sentence, shown by its lines."""
    return pytest.mark.parametrize("lines", table.values(), ids=list(table))
