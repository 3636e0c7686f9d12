"""A driver that waits too little fails in virtual time as on doubles in another process."""

from collections.abc import Callable
from typing import TypeAlias

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import Clock, OutsideClock, VirtualClock, WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.budget import transaction_ns
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.packets import Answered, Asked, Done, Transfer
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.adc import (
    CONVERSION,
    READING,
    Adc,
    AdcDouble,
    HastySampler,
    PatientSampler,
    Sampler,
)
from tests.support.stalling_clock import StallingClock

BUS_HZ = 100_000
STARTING = transaction_ns((bytes(3),), BUS_HZ)

Said: TypeAlias = list[tuple[int, object]]
Kind: TypeAlias = type[Sampler]


def run(kind: Kind, bus: AccountedBus, world: WorldClock, clock: Clock) -> Said:
    """Run a sampler on a bus; return readings and faults with their instants."""
    said: Said = []
    model = kind(Adc(bus))
    executive = Executive(model, clock, list, world_now=world)
    executive.simulator.listen(model.reading_out, lambda at, value: said.append((at, value)))
    executive.simulator.listen(model.fault_out, lambda at, fault: said.append((at, fault)))
    assert executive.run(SECOND).error is None
    return said


def in_process(kind: Kind, clock: Clock | None = None) -> Said:
    """On doubles in this process, in virtual time or on another clock."""
    world = WorldClock()
    double = I2cBusDouble("i2c1", world, [AdcDouble(world)], bus_hz=BUS_HZ, reach=world.reach)
    bus = AccountedBus(double, BUS_HZ, time=world)
    return run(kind, bus, world, clock or VirtualClock())


def served(kind: Kind) -> Said:
    """On doubles with a clock of their own, as in another process; both clocks go alike."""
    clock, theirs = VirtualClock(), ManualClock()
    double = I2cBusDouble("i2c1", theirs, [AdcDouble(theirs)], bus_hz=BUS_HZ, reach=theirs.reach)

    def ask(asked: Asked, _where: str) -> Answered:
        assert isinstance(asked, Transfer)
        theirs.reach(clock.now())
        return Done(double.transfer(asked.address, asked.messages))

    world = OutsideClock(clock.now)
    bus = AccountedBus(ServedBus("i2c1", ask), BUS_HZ, time=world)
    return run(kind, bus, world, clock)


@pytest.mark.parametrize("on_doubles", [in_process, served])
def test_a_model_that_counts_from_its_activation_gets_faults_and_from_the_transfer_samples(
    on_doubles: Callable[[Kind], Said],
) -> None:
    hasty, patient = ([value for _, value in on_doubles(k)] for k in (HastySampler, PatientSampler))
    assert min(len(hasty), len(patient)) > 400
    assert all(isinstance(value, Fault) and value.kind == "NotReady" for value in hasty)
    assert set(patient) == {READING}


def test_the_wait_is_the_time_on_the_wire_and_the_conversion_and_a_bus_held_up_before_counts() -> (
    None
):
    """The transfer that reads one conversion delays the one that starts the next."""
    first, second, *_ = (at for at, _ in in_process(PatientSampler))
    assert first == STARTING + CONVERSION
    assert second - first == transaction_ns((bytes(1), 2), BUS_HZ) + STARTING + CONVERSION


def test_a_run_that_is_late_within_tolerance_gives_the_very_samples_of_virtual_time() -> None:
    stalls = dict.fromkeys(range(2000), MILLISECOND // 3)
    assert in_process(PatientSampler, StallingClock(stalls)) == in_process(PatientSampler)


def test_after_a_late_start_the_chip_is_still_given_its_time() -> None:
    stalls = dict.fromkeys(range(0, 300, 7), 5 * MILLISECOND)
    said = [value for _, value in in_process(PatientSampler, StallingClock(stalls))]
    assert set(said) == {READING}
