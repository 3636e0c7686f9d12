"""What actuators say that they apply of their commands: when it changes, and at once."""

from dataclasses import replace

import pytest
from firmware_drivers.servo import Servos
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings
from firmware_drivers.treads import Treads, TreadSpeeds

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Applied, LeastApplied
from tests.support.pca9685_bench import Pca9685Bench, esc_bench
from tests.support.scripted_treads import ScriptedDriver, settings
from tests.support.servos import PAN, servos_settings

NOTHING, PART, ALL = Applied
WEAK = Forces(0.1, 0.0, 0.2, 0.0)


def thrust(slew_per_s: float = 1e6, *, enabled: bool = True) -> Pca9685Bench:
    given = ThrustSettings(0.4, 1000.0, slew_per_s, 50 * MILLISECOND, 0)
    return Pca9685Bench(
        lambda chip, interlock: ThrustPairs("thrust", chip, given, interlock), enabled=enabled
    )


def treads() -> Pca9685Bench:
    return Pca9685Bench(
        lambda _, interlock: Treads("treads", ScriptedDriver(), settings(), interlock)
    )


def servos() -> Pca9685Bench:
    both = servos_settings(PAN, replace(PAN, name="tilt", channel=3))
    return Pca9685Bench(lambda chip, interlock: Servos("head", chip, both, interlock))


@pytest.mark.parametrize(
    ("slew_per_s", "enabled", "pushes", "said"),
    [
        pytest.param(
            1e6,
            True,
            {100: WEAK, 110: WEAK, 120: WEAK},
            [(0, NOTHING), (100, ALL)],
            id="nothing from the start and all from the first command",
        ),
        pytest.param(
            1e6,
            False,
            dict.fromkeys(range(100, 200, 10), WEAK),
            [(0, NOTHING)],
            id="nothing is said while nothing changes however many commands come",
        ),
        pytest.param(
            1e6,
            True,
            {100: Forces(0.5, 0.0, 0.0, 0.0), 110: Forces(0.4, 0.0, 0.0, 0.0)},
            [(0, NOTHING), (100, PART), (110, ALL)],
            id="part of forces beyond a pair",
        ),
        pytest.param(
            20.0,
            True,
            {100: Forces(0.0, 0.0, 0.0, 0.0), 110: Forces(0.4, 0.0, 0.0, 0.0)},
            [(0, NOTHING), (100, ALL), (110, PART)],
            id="part of duties on their way",
        ),
    ],
)
def test_thrust_pairs_apply(
    slew_per_s: float,
    pushes: dict[int, Forces],
    said: list[tuple[int, Applied]],
    *,
    enabled: bool,
) -> None:
    bench = thrust(slew_per_s, enabled=enabled)
    for at_ms, forces in pushes.items():
        bench.put(at_ms, forces=forces)
    assert bench.said["applied"] == said


@pytest.mark.parametrize("silent_ms", [60, 5000])
def test_the_slew_counts_no_time_spent_off(silent_ms: int) -> None:
    bench = thrust(slew_per_s=2.0)
    bench.put(100 + silent_ms, forces=Forces(0.0, 0.0, 0.0, 0.0))
    assert bench.double.duties[0] == pytest.approx(0.1, abs=1 / 4096)


@pytest.mark.parametrize("cause", ["interlock", "chip", "silence", "no number"])
def test_whatever_switches_it_off_it_applies_nothing_at_once(cause: str) -> None:
    bench = thrust()
    bench.put(100, forces=WEAK)
    bench.enabled = cause != "interlock"
    if cause == "chip":
        bench.refuse(2)
    if cause == "silence":
        bench.run(160)
    else:
        bench.put(110, forces=Forces(float("nan"), 0, 0, 0) if cause == "no number" else WEAK)
    off_at = 150 if cause == "silence" else 110
    assert bench.said["applied"] == [(0, NOTHING), (100, ALL), (off_at, NOTHING)]


def test_treads_apply_part_of_speeds_that_were_clipped_and_nothing_while_disabled() -> None:
    bench = treads()
    bench.put(100, speeds=TreadSpeeds(0.5, 0.5))
    bench.put(110, speeds=TreadSpeeds(1.5, 0.5))
    bench.enabled = False
    bench.run(200)
    bench.enabled = True
    bench.run(300)
    assert bench.values("applied") == [NOTHING, ALL, PART, NOTHING, PART]


def test_driving_treads_notice_within_a_poll_that_they_were_disabled() -> None:
    bench = treads()
    bench.put(100, speeds=TreadSpeeds(0.5, 0.5))
    bench.run(110)
    bench.enabled = False
    bench.run(131)
    assert bench.values("applied")[-1] is NOTHING


def test_servos_apply_part_on_their_way_and_at_a_limit_and_nothing_when_limp() -> None:
    bench = servos()
    bench.put(100, pan=0.0)
    bench.put(110, pan=0.1)
    bench.put(310, pan=1.5)
    bench.put(2010, release=True)
    assert bench.values("applied") == [NOTHING, ALL, PART, ALL, PART, NOTHING]


def test_an_esc_applies_all_once_armed_and_part_of_a_throttle_beyond_1() -> None:
    bench = esc_bench()
    bench.put(100, arm=True)
    bench.put(3500, throttle=1.5)
    bench.put(3600, throttle=0.5)
    bench.put(3700, arm=False)
    assert bench.values("applied") == [NOTHING, ALL, PART, ALL, NOTHING]
    assert [at for at, _ in bench.said["applied"]][2:] == [3500, 3600, 3700]


def test_of_several_actuators_the_least_counts_and_one_that_said_nothing() -> None:
    top = Coupled("top")
    both = top.add(LeastApplied("both", ["left", "right"]))
    ports = {name: top.in_port(name, Applied) for name in ("left", "right")}
    for name, port in ports.items():
        top.couple(port, both.applied[name])
    simulator = Simulator(top, checked=True)
    said: list[Applied] = []
    simulator.listen(both.least, lambda _, applied: said.append(applied))
    for at, (name, applied) in enumerate(
        [("left", ALL), ("right", PART), ("right", ALL), ("left", NOTHING), ("right", PART)]
    ):
        simulator.inject(ports[name], applied)
        simulator.advance(at * MILLISECOND)
    assert said == [NOTHING, PART, ALL, NOTHING]
