"""Sonar, compass and treads models on register-level doubles, in virtual time."""

import pytest
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.compass import PERIODIC, Compass, CompassSettings
from firmware_drivers.sonar import RangeFinder, Sonar, SonarSettings
from firmware_drivers.treads import Treads, TreadSettings
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.atomic_bench import AtomicBench


class World:
    """Time as the doubles see it: the simulator's."""

    def __init__(self) -> None:
        self.bench: AtomicBench | None = None

    def __call__(self) -> int:
        return 0 if self.bench is None else self.bench.simulator.now

    def run(self, model: Atomic) -> AtomicBench:
        self.bench = AtomicBench(model)
        return self.bench


@pytest.fixture
def world() -> World:
    return World()


# Sonar --------------------------------------------------------------------------------------------


def sonar_on(world: World, chip: RangeFinder, period_ms: int) -> AtomicBench:
    period = period_ms * MILLISECOND
    return world.run(Sonar("sonar", chip, SonarSettings(period=period, threshold_m=1.0)))


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2_000_000), st.booleans()), max_size=40))
def test_starts_and_stops_at_any_time_never_disturb_a_ranging(
    orders: list[tuple[int, bool]],
) -> None:
    world = World()
    double = Srf08Double(world, 0x75, echoes=lambda _: [1.5])
    bus = I2cBusDouble("i2c-1", world, [double])
    bench = sonar_on(world, Srf08(bus, 0x75, Srf08Settings(max_range_m=11.0)), 66)
    for at_us, start in sorted(orders):
        bench.put(at_us / 1000, start=start)
    bench.run(2200)
    assert bus.errors == 1  # the silence that the bring-up asks for
    assert bench.faults == []
    assert list(double.warnings) == []
    assert set(bench.values("distance")) <= {1.5}


def test_a_sonar_unplugged_in_mid_run_is_a_fault_each_period_until_it_is_back(
    world: World,
) -> None:
    double = Srf08Double(world, 0x75, echoes=lambda _: [1.5])
    gone = AbsentTarget(target=double, since=1001 * MILLISECOND, until=1999 * MILLISECOND)
    bus = I2cBusDouble("i2c-1", world, [double], faults=FaultScript([gone]))
    bench = sonar_on(world, Srf08(bus, 0x75), 100)
    bench.put(100, start=1)
    bench.run(3000)
    times = [at for at, _ in bench.said["fault"]]
    assert len(times) == 10
    assert times[0] < 1100
    received = [at for at, _ in bench.said["distance"]]
    assert not any(1000 < at < 2000 for at in received)
    assert received[-1] > 2900


# Compass ------------------------------------------------------------------------------------------


def turning(at: int) -> float:
    """A vehicle that turns right by 60 degrees/s."""
    return 60.0 * at / SECOND % 360


@pytest.mark.slow
def test_a_compass_that_hangs_is_reported_and_sends_no_heading(world: World) -> None:
    double = Cmps12Double(world, 0x62, bearing_deg=turning)
    double.hangs_from = 5 * SECOND
    bus = I2cBusDouble("i2c-1", world, [double])
    chip = Cmps12(bus, 0x62, period_ns=50 * MILLISECOND)
    bench = world.run(Compass("compass2", chip, CompassSettings(period=50 * MILLISECOND)))
    bench.put(100, request=PERIODIC)
    bench.run(8000)
    first = bench.faults[0]
    assert (first.kind, first.axis) == ("Stuck", "field x, field y, field z")
    assert bench.said["fault"][0][0] == pytest.approx(5800, abs=100)
    assert bench.said["heading_deg"][-1][0] < 5900


# Treads -------------------------------------------------------------------------------------------


TREADS = TreadSettings(speed=0.5, refresh=100 * MILLISECOND)


@pytest.mark.slow
def test_a_silent_md25_is_reported_within_a_refresh_and_stopped_by_its_own_timeout(
    world: World,
) -> None:
    double = Md25Double(world, full_speed_rad_s=10.0)
    gone = AbsentTarget(target=double, since=5 * SECOND, until=8 * SECOND)
    bus = I2cBusDouble("i2c-1", world, [double], faults=FaultScript([gone]))
    bench = world.run(Treads("treads", Md25(bus), TREADS))
    bench.put(500, right=1, left=1)
    bench.run(6899)
    assert bench.said["fault"][0][0] == pytest.approx(5000, abs=100)
    assert double.speeds_rad_s != (0.0, 0.0)
    bench.run(6900)
    assert double.speeds_rad_s == (0.0, 0.0)
    bench.run(9000)
    assert bench.model.phase == "still"
    bench.put(9000, right=1, left=1)
    bench.run(10_000)
    assert double.speeds_rad_s == pytest.approx((5.0, 5.0), abs=0.05)
