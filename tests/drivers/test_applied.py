"""What actuators apply of their commands: said when it changes, and nothing while disabled."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
from firmware_drivers.servo import Servos
from firmware_drivers.thrust_pairs import ThrustPairs, ThrustSettings
from firmware_drivers.treads import Treads

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Applied, LeastApplied
from tests.support.atomic_bench import AtomicBench
from tests.support.pca9685_bench import Pca9685Bench, esc_bench
from tests.support.scripted_treads import ScriptedDriver, settings
from tests.support.servos import PAN, servos_settings
from tests.support.wire import sentences

BOTH = servos_settings(PAN, replace(PAN, name="tilt", channel=3))


def thrust(slew_per_s: float = 1e6) -> Pca9685Bench:
    given = ThrustSettings(0.4, 1000.0, slew_per_s, 50 * MILLISECOND, 0)
    return Pca9685Bench(lambda chip, interlock: ThrustPairs("thrust", chip, given, interlock))


class TreadsBench(Pca9685Bench):
    """Treads on a scripted driver; the PCA9685 has no part in it."""

    def __init__(self) -> None:
        self.driver = ScriptedDriver()
        self.driver.now = self.now
        super().__init__(lambda _, interlock: Treads("treads", self.driver, settings(), interlock))

    @property
    def driven(self) -> str:
        return " ".join(str(call).replace(", ", "/") for call, _ in self.driver.driven)


BENCHES: Mapping[str, Callable[[], Pca9685Bench]] = {
    "thrust": thrust,
    "slow thrust": lambda: thrust(20.0),
    "treads": TreadsBench,
    "servos": lambda: Pca9685Bench(lambda chip, lock: Servos("head", chip, BOTH, lock)),
    "esc": esc_bench,
}
WEAK, NONE, ALL, FAR = (f"forces=({f1},0,0.2,0)" for f1 in (0.1, 0.0, 0.4, 0.5))
MANY = "; ".join(f"{at_ms} {WEAK}" for at_ms in range(100, 200, 10))
DRIVING = "50 right=1 left=1"
NAN = "; ".join(f"{at_ms} speeds=(nan,0.5)" for at_ms in range(41, 60))


@sentences(
    {
        "nothing from the start and all from the first command": (
            f"thrust: 100 {WEAK}; 110 {WEAK}; 120 {WEAK}; applied is NOTHING ALL; "
            "applied_at is 0 100"
        ),
        "nothing is said while nothing changes however many commands come": (
            f"thrust: switch; {MANY}; applied is NOTHING; off is True; consecutive is ()"
        ),
        "part of forces beyond a pair": (
            f"thrust: 100 {FAR}; 110 {ALL}; applied is NOTHING PART ALL; applied_at is 0 100 110"
        ),
        "part of duties on their way": (
            f"slow thrust: 100 {NONE.replace('0.2', '0')}; 110 {ALL}; applied is NOTHING ALL PART"
        ),
        "nothing at once when the interlock switches it off": (
            f"thrust: 100 {WEAK}; switch; 110 {WEAK}; applied is NOTHING ALL NOTHING; "
            "applied_at is 0 100 110; off is True; consecutive is (); switch; 120 "
            f"{WEAK}; off is False"
        ),
        "nothing at once when the chip fails": (
            f"thrust: 100 {WEAK}; refuse 2; 110 {WEAK}; applied is NOTHING ALL NOTHING; "
            "applied_at is 0 100 110"
        ),
        "nothing at once when no forces come": (
            f"thrust: 100 {WEAK}; 160; applied is NOTHING ALL NOTHING; applied_at is 0 100 150"
        ),
        "nothing at once of what is no number": (
            f"thrust: 100 {WEAK}; 110 forces=(nan,0,0,0); applied is NOTHING ALL NOTHING; "
            "applied_at is 0 100 110"
        ),
        "a chip that failed may be enabled again once it answers": (
            f"thrust: 100 {WEAK}; refuse 3; 110 {WEAK}; switch; "
            f"unready is has failed 2 times in a row; 160 {WEAK}; off is True; unready is ()"
        ),
        "all of signals after speeds that were clipped": (
            "treads: 50 speeds=(2.0,0.0); 60 right=1 left=1; applied is NOTHING PART ALL"
        ),
        "part of speeds that were clipped and nothing while disabled": (
            "treads: 100 speeds=(0.5,0.5); 110 speeds=(1.5,0.5); switch; 200; switch; 300; "
            "applied is NOTHING ALL PART NOTHING PART"
        ),
        "driving treads notice within a poll that they were disabled": (
            "treads: 100 speeds=(0.5,0.5); 110; switch; 131; applied is NOTHING ALL NOTHING"
        ),
        "a command to treads is kept until enabled": (
            f"treads: switch; {DRIVING}; 500; switch; 530; driven is stop (0.5/0.5)"
        ),
        "moving treads are stopped and go on once enabled": (
            f"treads: {DRIVING}; 60; switch; 300; switch; 330; driven is (0.5/0.5) stop (0.5/0.5)"
        ),
        "a command that is none is reported while disabled and forgets the one before": (
            f"treads: switch; {DRIVING}; 60 speeds=(nan,0.5); consecutive is 1; 70 left=3; "
            "consecutive is 1 2; phase is disabled; switch; 130; driven is stop (0.0/0.0); "
            "200 left=1; driven is stop (0.0/0.0) (0.5/0.0)"
        ),
        "the first command that is none is reported although disabled": (
            "treads: switch; 50 speeds=(nan,nan); consecutive is 1; driven is stop"
        ),
        "a command after one that was none is kept until enabled": (
            f"treads: switch; 30 speeds=(nan,0.5); {DRIVING}; switch; 130; consecutive is 1; "
            "driven is stop (0.5/0.5)"
        ),
        "commands that are none put off no look at the interlock": (
            f"treads: switch; 40 left=1; {NAN}; switch; 61; driven is stop (0.0/0.0)"
        ),
        "part on their way and at a limit and nothing when limp": (
            "servos: 100 pan=0.0; 110 pan=0.1; 310 pan=1.5; 2010 release=True; "
            "applied is NOTHING ALL PART ALL PART NOTHING"
        ),
        "all again of a servo that was at a limit and is commanded back within it": (
            "servos: 100 pan=1.0; 110 pan=1.5; 310 pan=0.9; 2010; applied is NOTHING ALL PART ALL"
        ),
        "all once armed and part of a throttle beyond 1": (
            "esc: 100 arm=True; 3500 throttle=1.5; 3600 throttle=0.5; 3700 arm=False; "
            "applied is NOTHING ALL PART ALL NOTHING; applied_at is 0 3100 3500 3600 3700"
        ),
        "an esc that is disabled or off reports a throttle that is no number": (
            "esc: 900 throttle=nan; consecutive is 1; switch; 1000 arm=True; 1100 throttle=inf; "
            "consecutive is 1 2; phase is disabled; 1110; switch; 9000; armed is 4120"
        ),
        "an esc is armed again once outputs are enabled again": (
            "esc: switch; 1000 arm=True; 5000; armed is (); phase is disabled; switch; 9000; "
            "armed is 8020; switch; 10000; armed is 8020 -9020; phase is disabled; switch; 14000; "
            "armed is 8020 -9020 13020"
        ),
    }
)
def test_applied(lines: str) -> None:
    """Lines on the bench that they begin with."""
    kind, _, lines = lines.partition(": ")
    BENCHES[kind]().play(lines)


@pytest.mark.parametrize("silent_ms", [60, 5000])
def test_the_slew_counts_no_time_spent_off(silent_ms: int) -> None:
    bench = thrust(slew_per_s=2.0)
    bench.play(f"{100 + silent_ms} forces=(0,0,0,0)")
    assert bench.double.duties[0] == pytest.approx(0.1, abs=1 / 4096)


def test_of_several_actuators_the_least_counts_and_one_that_said_nothing() -> None:
    bench = AtomicBench(LeastApplied("both", ["left", "right"]))
    nothing, part, all_ = Applied
    said = [("left", all_), ("right", part), ("right", all_), ("left", nothing), ("right", part)]
    for at_ms, (name, applied) in enumerate(said):
        bench.put(at_ms, **{name: applied})
    assert bench.values("least") == [nothing, part, all_, nothing]
