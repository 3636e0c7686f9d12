"""With outputs disabled nothing that could move is written; enabled, commands are obeyed."""

import pytest
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings
from firmware_drivers.treads import Treads

from firmware_runtime.devs.time import MILLISECOND
from tests.support.pca9685_bench import Pca9685Bench, esc_bench
from tests.support.scripted_treads import STOP, ScriptedDriver, settings


class ThrustBench(Pca9685Bench):
    """Thrust pairs on a double, with forces every 10 ms."""

    def __init__(self) -> None:
        thrust = ThrustSettings(0.4, 1000.0, 1e6, 50 * MILLISECOND, 0)
        super().__init__(
            lambda chip, interlock: ThrustPairs("thrust", chip, thrust, interlock), enabled=False
        )
        self._at = 100

    def push(self, times: int) -> int:
        """Return how many propellers turn afterwards."""
        for _ in range(times):
            self._at += 10
            self.put(self._at, forces=Forces(0.2, 0.2, 0.2, 0.2))
        return sum(duty > 0 for duty in self.double.duties)


def test_forces_have_no_effect_while_outputs_are_disabled() -> None:
    bench = ThrustBench()
    assert bench.push(5) == 0
    bench.enabled = True
    assert bench.push(5) == 8
    bench.enabled = False
    assert bench.push(1) == 0
    assert bench.double.all_off
    assert bench.faults == []


def test_thrust_pairs_that_failed_may_be_enabled_again_once_the_chip_answers() -> None:
    bench = ThrustBench()
    bench.enabled = True
    bench.push(2)
    bench.refuse(3)
    bench.push(1)
    bench.enabled = False
    assert bench.unready() == "has failed 2 times in a row"
    assert bench.push(5) == 0
    assert bench.unready() is None


@pytest.mark.parametrize(
    ("switched_at", "driven"),
    [
        pytest.param([500], [STOP, (0.5, 0.5)], id="a command is kept until enabled"),
        pytest.param(
            [0, 60, 300],
            [(0.5, 0.5), STOP, (0.5, 0.5)],
            id="moving treads are stopped and go on once enabled",
        ),
    ],
)
def test_treads_obey_the_interlock(switched_at: list[int], driven: list[object]) -> None:
    driver = ScriptedDriver()
    bench = Pca9685Bench(
        lambda _, interlock: Treads("treads", driver, settings(), interlock), enabled=False
    )
    driver.now = bench.now
    commands = {50: {"right": 1, "left": 1}}
    for at_ms in sorted({*switched_at, *commands}):
        bench.run(at_ms)
        bench.put(at_ms, **commands[at_ms]) if at_ms in commands else bench.switch()
    bench.run(switched_at[-1] + 30)
    assert [call for call, _ in driver.driven] == driven


def test_an_esc_is_armed_again_once_outputs_are_enabled_again() -> None:
    bench = esc_bench(enabled=False)
    bench.play("1000 arm=True; 5000; armed is (); phase is disabled; switch; 9000; armed is 8020")
    bench.play("switch; 10000; armed is 8020 -9020; phase is disabled; switch; 14000")
    assert bench.values("armed") == [True, False, True]
