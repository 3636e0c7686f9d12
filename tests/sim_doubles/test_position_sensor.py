import math
import statistics

import pytest
from firmware_boards.tachobot.plant_settings import PositionSensorSettings
from msgspec.structs import replace

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.position_fix import PositionFix
from sim_doubles.worlds.position_sensor import PositionSensor, TruePose

DELAY_S = 0.12
PLAIN = PositionSensorSettings(delay_s=DELAY_S, noise_m=0.0, yaw_noise_rad=0.0)


def sent(until_s: float, ahead: int = 0, **changes: object) -> list[tuple[int, PositionFix]]:
    """What a sensor sends of a body that moves along x at 1 m/s; its world may run ahead."""
    parameters = replace(PLAIN, **changes)
    top = Coupled("top")
    clock: list[Simulator] = []

    def now() -> int:
        return (clock[0].now if clock else 0) + ahead

    sensor = top.add(PositionSensor(parameters, lambda: TruePose(now() / SECOND, 2.0, 0.1), now))
    simulator = Simulator(top, checked=True)
    clock.append(simulator)
    found: list[tuple[int, PositionFix]] = []
    simulator.listen(sensor.position, lambda at, value: found.append((at, value)))
    simulator.run(round(until_s * SECOND))
    return found


@pytest.mark.parametrize("ahead", [0, 700_000])
def test_a_position_comes_a_delay_after_it_was_measured_and_says_so(ahead: int) -> None:
    found = sent(2.0, ahead)
    assert [at for at, _ in found[:3]] == [170 * MILLISECOND, 220 * MILLISECOND, 270 * MILLISECOND]
    for at, fix in found:
        assert fix.x_m == pytest.approx(at / SECOND - fix.age_s)
        assert fix.y_m == 2.0


def test_without_delay_it_comes_at_once() -> None:
    assert sent(0.06, delay_s=0.0) == [(50 * MILLISECOND, PositionFix(0.05, 2.0, 0.0))]


@pytest.mark.slow
def test_the_stated_share_is_dropped_by_seed() -> None:
    first, again, other = (sent(100.0, dropout=0.3, seed=seed) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len(first) / 1998 == pytest.approx(0.7, abs=0.04)
    assert sent(10.0, dropout=1.0) == []


def test_in_an_outage_nothing_is_measured() -> None:
    origins = [at - DELAY_S * SECOND for at, _ in sent(5.0, outages_s=((1.0, 3.0),))]
    assert not any(SECOND <= at < 3 * SECOND for at in origins)
    assert len(origins) == 97 - 40


@pytest.mark.slow
def test_the_noise_is_as_large_as_stated() -> None:
    offs = [fix.y_m - 2.0 for _, fix in sent(100.0, noise_m=0.02)]
    assert statistics.stdev(offs) == pytest.approx(0.02, rel=0.06)
    assert abs(statistics.mean(offs)) < 0.02 * 4 / math.sqrt(len(offs))
