"""The model alone, on the double of its chip."""

from itertools import pairwise

import pytest
from underwater.plumb.double import PlumbDouble
from underwater.plumb.driver import Plumb, Sounding
from underwater.plumb.gauge import Gauge

from firmware_runtime import MILLISECOND, Simulator
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble

PERIOD = 50 * MILLISECOND


class Bench:
    """One gauge in virtual time; its transfers end `late` ns after the instant of their step."""

    def __init__(self) -> None:
        self.at = self.late = 0
        self.bus = I2cBusDouble("i2c1", lambda: self.at, [PlumbDouble(lambda: self.at)])
        self.bus.elapsed = lambda: self.late  # type: ignore[method-assign]
        self.gauge = Gauge("gauge", Plumb(self.bus), PERIOD)
        self.simulator = Simulator(self.gauge, checked=True)
        self.soundings: list[tuple[int, Sounding]] = []
        self.faults: list[str] = []
        self.simulator.listen(
            self.gauge.sounding_out, lambda at, value: self.soundings.append((at, value))
        )
        self.simulator.listen(self.gauge.fault_out, lambda _, fault: self.faults.append(fault.kind))
        self.simulator.run(0)

    def run_for(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.at += MILLISECOND
            self.simulator.run(self.at)


def test_there_is_a_sounding_every_period() -> None:
    bench = Bench()
    bench.run_for(1000)
    instants = [at for at, _ in bench.soundings]
    assert {later - at for at, later in pairwise(instants)} == {PERIOD}
    assert bench.soundings[-1][1].depth_m == pytest.approx(0.0, abs=1e-4)
    assert (len(instants), bench.faults) == (20, [])


@pytest.mark.parametrize(("late", "apart"), [(3, 50), (200, 410)])
def test_transfers_that_end_late_are_waited_for(late: int, apart: int) -> None:
    bench = Bench()
    bench.run_for(100)
    bench.late = late * MILLISECOND
    bench.run_for(2000)
    (_, (before, _), (last, _)) = bench.soundings[-3:]
    assert (last - before, bench.faults) == (apart * MILLISECOND, [])


def test_a_silent_chip_is_a_fault_and_no_sounding_until_it_answers_again() -> None:
    bench = Bench()
    bench.run_for(100)
    count = len(bench.soundings)
    bench.bus.faults = FaultScript([NackAddress(address=0x76, times=2)])
    bench.run_for(100)
    assert (bench.faults, len(bench.soundings)) == (["NoAcknowledge"] * 2, count)
    bench.run_for(100)
    assert len(bench.soundings) > count
    assert bench.gauge.unready() is None
