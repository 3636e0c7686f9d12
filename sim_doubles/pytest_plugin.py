"""Fixtures that put doubles behind the driver under test, in any package's pytest.

    def test_half_throttle(i2c_double):
        chip = i2c_double("pca9685", address=0x40)
        MyMotor(SMBus(1)).throttle(0.5)
        assert chip.duty(0) == pytest.approx(0.5)

Within a test that asks for `i2c_bus` or `i2c_double`, `smbus2.SMBus`, `smbus.SMBus` and `busio.I2C`
open the test's bus. pytest finds this module by its entry point and imports it in every session of
the environment, so it imports nothing of the doubles until a fixture is used.
"""

import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest

from firmware_runtime.hal.circuitpython.stand_ins import MODULES, StandIns

if TYPE_CHECKING:
    from firmware_runtime import OpenBoard
    from firmware_runtime.hal.budget import WireClock
    from sim_doubles.faults import FaultScript
    from sim_doubles.i2c_bus import I2cBusDouble
    from sim_doubles.testing.buses import TestBuses
    from sim_doubles.testing.serial import SerialDoubles
    from sim_doubles.testing.timing import Run
    from sim_doubles.testing.virtual_time import VirtualTime
    from sim_doubles.testing.wire_log import WireLog

KEEP_BLINKA = "keep_blinka"
STRICT_TIMING = "strict_timing"
STAND_INS = {**MODULES, "busio": "sim_doubles.busio", "smbus": "sim_doubles.smbus"}
"""Modules that a test imports and a PC does not have."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the settings that leave Blinka to itself, and that let no timing be excused."""
    parser.addini(
        KEEP_BLINKA,
        "import board, busio and digitalio from Blinka, for tests on hardware",
        type="bool",
        default=False,
    )
    parser.addini(
        STRICT_TIMING,
        "assert_timing fails rather than skips where conditions may be why, for a robot's own CI",
        type="bool",
        default=False,
    )


def pytest_configure(config: pytest.Config) -> None:
    """Let tests import what a Raspberry Pi has; see `StandIns`."""
    stand_ins = StandIns(STAND_INS, keep_blinka=config.getini(KEEP_BLINKA))
    stand_ins.install()
    config.add_cleanup(stand_ins.remove)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Let drivers open their bus when they are imported, before any test has one."""
    from sim_doubles import early

    with early.openings():
        return (yield)


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """Show what went over a bus beside what was expected, line by line."""
    if op != "==" or "sim_doubles.testing.wire_log" not in sys.modules:
        return None
    from sim_doubles.testing.wire_log import explained

    return explained(left, right)


@pytest.fixture
def virtual_time(monkeypatch: pytest.MonkeyPatch) -> "VirtualTime":
    """A clock that `time.sleep` and the wire move on; every driver and every double is on it."""
    from sim_doubles.testing.virtual_time import VirtualTime

    clock = VirtualTime()
    clock.rule(monkeypatch)
    return clock


@pytest.fixture
def doubles_clock(request: pytest.FixtureRequest) -> "WireClock":
    """The clock the test's doubles are on: virtual where the test asks for `virtual_time`."""
    if "virtual_time" in request.fixturenames:
        clock: VirtualTime = request.getfixturevalue("virtual_time")
        return clock
    from sim_doubles.testing.virtual_time import running_time

    return running_time()


@pytest.fixture
def i2c_buses(doubles_clock: "WireClock", monkeypatch: pytest.MonkeyPatch) -> "Iterator[TestBuses]":
    """The test's buses by number, for a robot with more than one."""
    from sim_doubles.testing.buses import TestBuses
    from sim_doubles.testing.substitution import open_doubles

    open_doubles(monkeypatch)
    buses = TestBuses(doubles_clock)
    yield buses
    buses.end()


@pytest.fixture
def i2c_bus(i2c_buses: "TestBuses") -> "I2cBusDouble":
    """The bus that `SMBus(1)` and `busio.I2C()` open in this test; no chip is on it yet."""
    return i2c_buses.bus(1)


@pytest.fixture
def i2c_double(i2c_bus: "I2cBusDouble", i2c_buses: "TestBuses") -> Callable[..., Any]:
    """Wires a chip to the bus: `i2c_double("pca9685", address=0x40)`; returns the double."""
    del i2c_bus
    return i2c_buses.connect


@pytest.fixture
def i2c_faults(i2c_bus: "I2cBusDouble") -> "FaultScript":
    """Return the bus' faults: `i2c_faults.add(NackAddress(first=3))`; counts what struck."""
    from sim_doubles.faults import FaultScript

    i2c_bus.faults = script = FaultScript()
    return script


@pytest.fixture
def i2c_strike(i2c_buses: "TestBuses") -> Callable[..., None]:
    """Breaks chips by kind, from now on: `i2c_strike("freeze", "0x68", for_s=1.0)`."""
    return i2c_buses.strike


@pytest.fixture
def i2c_log(i2c_bus: "I2cBusDouble") -> "WireLog":
    """Return the bus' traffic, as lines to compare with a list of them."""
    from sim_doubles.testing.wire_log import WireLog

    return WireLog(i2c_bus)


@pytest.fixture
def no_protocol_warning(
    i2c_buses: "TestBuses", serial_doubles: "SerialDoubles"
) -> Callable[[], None]:
    """Fails the test whose devices were asked what no real one takes; call it to look."""

    def check() -> None:
        __tracebackhide__ = True
        if warnings := [*i2c_buses.warnings(), *serial_doubles.warnings()]:
            listing = "\n".join(f"  {each}" for each in warnings)
            pytest.fail(f"protocol warnings, expected none:\n{listing}", pytrace=False)

    return check


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Let the test fail at its end that wants no protocol warning, and had one."""
    result = yield
    look = getattr(item, "funcargs", {}).get("no_protocol_warning")
    if look is not None:
        look()
    return result


@pytest.fixture
def board() -> "Iterator[Callable[..., OpenBoard]]":
    """Opens a robot on its doubles in virtual time: `board("tachobot", set={...}).run(10.0)`.

    Takes what `firmware_runtime.open_board` takes; outputs are off and it is closed at the end.
    """
    from firmware_runtime import open_board

    with ExitStack() as opened:

        def opened_board(name: str, **choices: Any) -> "OpenBoard":  # noqa: ANN401
            chosen = {"doubles": True, "clock": "virtual", **choices}
            return opened.enter_context(open_board(name, **chosen))

        yield opened_board


@pytest.fixture
def assert_timing(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Fails a test whose run broke a limit: `assert_timing(robot, p99_us=500, skips=0)`.

    Where the machine may be why, the test is skipped with the reason; `strict=True`, or
    `strict_timing = true` in pytest's settings, fails it there too.
    """
    from firmware_runtime.system.conditions import Neighbours
    from sim_doubles.testing.timing import assert_timing

    since = Neighbours()
    is_strict = bool(request.config.getini(STRICT_TIMING))

    def asserted(run: "Run", *, strict: bool = is_strict, **limits: Any) -> None:  # noqa: ANN401
        __tracebackhide__ = True
        assert_timing(run, strict=strict, neighbours=since.shares(), **limits)

    return asserted


@pytest.fixture
def serial_doubles(doubles_clock: "WireClock") -> "Iterator[SerialDoubles]":
    """The test's serial devices."""
    from sim_doubles.testing.serial import SerialDoubles

    doubles = SerialDoubles(doubles_clock)
    yield doubles
    doubles.end()


@pytest.fixture
def serial_double(serial_doubles: "SerialDoubles") -> Callable[..., Any]:
    """Puts a device behind a port: `serial_double("sabertooth")`; `path` is what pyserial opens."""
    return serial_doubles.connect
