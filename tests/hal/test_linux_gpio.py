"""The enable line on libgpiod's binding: the real one where it refuses, a stand-in where it works.

This machine's kernel has no GPIO chip; what the stand-in is asked is what a chip would be.
"""

import errno
import sys
from types import SimpleNamespace
from typing import Any

import gpiod
import pytest

from firmware_runtime.hal.linux_gpio import open_enable_line
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusInUse, PortClosed

Value = gpiod.line.Value


class StandIn:
    """Takes requests as the binding does; `refusal` and `fault` are what the kernel answers."""

    line, LineSettings = gpiod.line, gpiod.LineSettings

    def __init__(self) -> None:
        self.refusal: Exception | None = None
        self.fault: OSError | None = None
        self.asked: list[Any] = []

    def request_lines(self, chip: str, config: dict[int, Any], *, consumer: str) -> SimpleNamespace:
        if self.refusal is not None:
            raise self.refusal
        self.asked.append((chip, config, consumer))
        return SimpleNamespace(set_value=self._set, release=lambda: self.asked.append("released"))

    def _set(self, line: int, value: Value) -> None:
        if self.fault is not None:
            raise self.fault
        self.asked.append((line, value))


@pytest.fixture
def binding(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    stand_in = StandIn()
    monkeypatch.setitem(sys.modules, "gpiod", stand_in)
    return stand_in


@pytest.mark.parametrize("active_low", [True, False])
def test_a_line_is_taken_disabled_and_given_up_disabled(
    binding: StandIn, *, active_low: bool
) -> None:
    line = open_enable_line("output_enable", "/dev/gpiochip0", 17, active_low=active_low)
    ((chip, config, consumer),) = binding.asked
    assert (chip, list(config), consumer) == ("/dev/gpiochip0", [17], "firmware-runtime")
    assert config[17].direction is gpiod.line.Direction.OUTPUT
    assert config[17].output_value is Value.INACTIVE
    assert config[17].active_low is active_low
    line.set(True)
    line.close()
    line.close()
    assert binding.asked[1:] == [(17, Value.ACTIVE), (17, Value.INACTIVE), "released"]
    with pytest.raises(PortClosed, match="after it was closed"):
        line.set(True)


def test_a_line_that_fails_is_a_bus_fault_and_given_up_all_the_same(binding: StandIn) -> None:
    line = open_enable_line("output_enable", "/dev/gpiochip0", 17)
    binding.fault = OSError(errno.EIO, "Input/output error")
    with pytest.raises(BusFault, match=r"output_enable: line 17 cannot be set \(Input/output"):
        line.set(True)
    with pytest.raises(BusFault):
        line.close()
    assert binding.asked[-1] == "released"


@pytest.mark.parametrize(
    ("refusal", "kind", "what"),
    [
        (OSError(errno.EBUSY, "busy"), BusInUse, "held by another process"),
        (OSError(errno.EACCES, "denied"), BusAbsent, "add the user to its group, gpio"),
        (OSError(errno.ENOENT, "none"), BusAbsent, "expected a chip that `gpiodetect` shows"),
        (OSError(errno.EINVAL, "no"), BusAbsent, "expected one `gpioinfo` shows"),
        (ValueError("offset"), BusAbsent, "expected one `gpioinfo` shows"),
        (OSError(errno.EIO, "broken"), BusAbsent, "cannot be taken"),
    ],
)
def test_a_refusal_names_its_fix(
    binding: StandIn, refusal: Exception, kind: type[Exception], what: str
) -> None:
    binding.refusal = refusal
    with pytest.raises(kind, match=what):
        open_enable_line("output_enable", "/dev/gpiochip0", 17)


def test_the_binding_itself_refuses_a_chip_that_is_not_there() -> None:
    with pytest.raises(BusAbsent, match="/dev/no-such-chip line 17 does not exist"):
        open_enable_line("output_enable", "/dev/no-such-chip", 17)


def test_without_the_binding_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gpiod", None)
    with pytest.raises(BusAbsent, match=r"-m pip install 'gpiod>="):
        open_enable_line("output_enable", "/dev/gpiochip0", 17)
