"""`firmware_drivers.circuitpython`: `busio.I2C` over the HAL, and a driver as a hardware model."""

import errno
import sys
import time
from importlib import import_module
from threading import Thread
from typing import Any

import pytest
from firmware_drivers.circuitpython import Busio, CircuitPythonSensor, driver_calls, imports

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import (
    EREMOTEIO,
    BusTimeout,
    Fault,
    NoAcknowledge,
    NotReady,
    WrongDevice,
)
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import AdapterError, FaultScript, NackAddress
from tests.support.virtual_bus import VirtualBus


@pytest.fixture
def rig() -> VirtualBus:
    rig = VirtualBus()
    rig.connect(Pca9685Double)
    return rig


def prescale(i2c: Busio) -> int:
    """Read PRE_SCALE as drivers for CircuitPython do."""
    answer = bytearray(1)
    assert i2c.try_lock()
    try:
        i2c.writeto_then_readfrom(0x40, b"\xfe", answer)
    finally:
        i2c.unlock()
    return answer[0]


def probe(i2c: Busio) -> None:
    """Ask for the chip as adafruit_bus_device does."""
    try:
        prescale(i2c)
    except OSError:
        raise ValueError("No I2C device at address: 0x40") from None


def sensor(rig: VirtualBus, **changes: object) -> CircuitPythonSensor[Busio, int]:
    stated: dict[str, Any] = {"make": lambda i2c: i2c, "read": prescale, "kind": int}
    stated |= {"period": 10 * MILLISECOND, **changes}
    return CircuitPythonSensor("sensor", rig.bus, **stated)


def test_a_refusal_is_accounted_retried_and_then_an_os_error_with_its_errno(
    rig: VirtualBus,
) -> None:
    assert prescale(Busio(rig.bus)) == 0x1E
    assert (rig.bus.transactions, rig.bus.by_address[0x40].bytes) == (1, 4)
    rig.doubles.faults = FaultScript([NackAddress(times=2), NackAddress(first=4, times=3)])
    assert prescale(Busio(rig.bus)) == 0x1E
    with pytest.raises(OSError, match="0x40") as refused:
        prescale(Busio(rig.bus))
    assert refused.value.errno == EREMOTEIO
    assert isinstance(refused.value.__cause__, NoAcknowledge)
    assert rig.bus.retries == 4


def test_a_wrapped_error_becomes_the_hal_error_again(rig: VirtualBus) -> None:
    rig.doubles.faults = FaultScript([AdapterError(errno=errno.ETIMEDOUT)])
    with pytest.raises(BusTimeout), driver_calls(rig.bus):
        probe(Busio(rig.bus))


@pytest.mark.parametrize(
    ("raised", "expected"),
    [
        (OSError(EREMOTEIO, ""), NoAcknowledge),
        (RuntimeError("Failed to find chip"), WrongDevice),
        (TypeError("a bug, which is no HalError"), TypeError),
    ],
)
def test_an_error_of_the_drivers_own_is_named_by_its_kind(
    rig: VirtualBus, raised: Exception, expected: type[Exception]
) -> None:
    with pytest.raises(expected), driver_calls(rig.bus):
        raise raised


def test_a_driver_sleeps_in_the_time_of_the_lines(rig: VirtualBus) -> None:
    real = time.sleep
    with driver_calls(rig.bus):
        time.sleep(3.0)
    assert rig.clock() == 3 * SECOND
    assert time.sleep is real


def test_what_another_thread_sleeps_is_not_the_time_of_the_lines(rig: VirtualBus) -> None:
    with driver_calls(rig.bus):
        other = Thread(target=time.sleep, args=(1e-6,))
        other.start()
        other.join()
        assert rig.clock() == 0


def test_a_driver_that_is_refused_is_made_again_until_it_is_there(rig: VirtualBus) -> None:
    def made(i2c: Busio) -> Busio:
        prescale(i2c)
        return i2c

    rig.doubles.faults = FaultScript([NackAddress(times=6)])
    model = sensor(rig, make=made)
    received = rig.simulate([model], model.fault_out, model.value)
    rig.run(250 * MILLISECOND)
    assert [value.kind for _, value in received[:2]] == ["NoAcknowledge"] * 2
    assert received[2][1] == 0x1E


def test_a_reading_leaves_every_period_or_a_failure_is_a_fault_and_no_value(
    rig: VirtualBus,
) -> None:
    model = sensor(rig)
    received = rig.simulate([model], model.fault_out, model.value)
    rig.run(15 * MILLISECOND)
    rig.doubles.faults = FaultScript([NackAddress(times=3)])
    rig.run(35 * MILLISECOND)
    first, fault, last = received
    assert isinstance(fault[1], Fault)
    assert [at for at, _ in (first, last)] == [10 * MILLISECOND, 30 * MILLISECOND]
    assert (first[1], fault[1].kind, last[1]) == (0x1E, "NoAcknowledge", 0x1E)
    assert model.unready() is None


def test_none_is_not_ready_and_after_three_failures_the_driver_is_made_again(
    rig: VirtualBus,
) -> None:
    made: list[Busio] = []

    def make(i2c: Busio) -> Busio:
        made.append(i2c)
        return i2c

    model = sensor(rig, make=make, read=lambda _: None)
    received = rig.simulate([model], model.fault_out)
    rig.run(35 * MILLISECOND)
    assert [value.kind for _, value in received] == [NotReady.__name__] * 3
    assert len(made) == 2


def test_no_period_is_refused(rig: VirtualBus) -> None:
    with pytest.raises(SettingError, match="sensor"):
        sensor(rig, period=0)


def test_names_of_circuitpython_are_there_while_importing() -> None:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("busio", "board"):
            patch.delitem(sys.modules, name, raising=False)
        with imports():
            board = import_module("board")
            with pytest.raises(NotImplementedError, match="Busio"):
                board.I2C()
