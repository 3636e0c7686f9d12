"""What a test asks its buses for and cannot have is refused where it is asked for."""

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.testing.buses import TestBuses


def test_a_second_chip_at_one_address_is_refused() -> None:
    buses = TestBuses(ManualClock(SECOND))
    try:
        buses.connect("pca9685", 0x40)
        buses.connect("pca9685", 0x41)
        buses.connect("pca9685", 0x40, bus=3)
        with pytest.raises(ConfigError, match="0x40 on i2c-1"):
            buses.connect("pca9685", 0x40)
        assert len(buses.bus(1).targets) == 2
    finally:
        buses.end()


@pytest.mark.parametrize("bus", [-1, 1.0, None, True])
def test_a_bus_is_a_number_or_a_path(bus: object) -> None:
    with pytest.raises(ConfigError):
        TestBuses(ManualClock()).bus(bus)  # type: ignore[arg-type]


def test_an_address_that_is_text_is_refused() -> None:
    with pytest.raises(ConfigError):
        TestBuses(ManualClock(SECOND)).connect("pca9685", "0x40")  # type: ignore[arg-type]


def test_a_fault_script_takes_faults_alone() -> None:
    script = FaultScript([NackAddress()])
    for no_fault in (3, NackAddress):
        with pytest.raises(TypeError):
            script.add(no_fault)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        FaultScript([None])  # type: ignore[list-item]
