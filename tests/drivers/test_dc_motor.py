"""One DC motor on an H-bridge of a PCA9685's double: commands, stops and what is no command."""

import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.dc_motor import DcMotor, DcMotorSettings

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import SettingError
from tests.support.pca9685_bench import Pca9685Bench
from tests.support.wire import sentences

PWM, IN1, IN2 = 8, 9, 10


class Bench(Pca9685Bench):
    """A motor whose chip may drive others, too."""

    def __init__(self, timeout: int = NEVER, *, brakes: bool = False) -> None:
        settings = DcMotorSettings(frequency_hz=1000.0, timeout=timeout, brakes=brakes)
        super().__init__(
            lambda chip, interlock: DcMotor(
                "motor", HBridge(chip, PWM, IN1, IN2), settings, interlock
            )
        )

    @property
    def turns(self) -> str:
        """What PWM, IN1 and IN2 mean."""
        pwm, *sense = self.double.duties[PWM : IN2 + 1]
        words: dict[tuple[float, ...], str] = {
            (1, 0): f"ahead {pwm:.12g}",
            (0, 1): f"back {pwm:.12g}",
            (1, 1): "brake",
            (0, 0): "off",
        }
        return words[tuple(sense)]

    @property
    def reasons(self) -> str:
        return " ".join(fault.reason for fault in self.faults)


@pytest.fixture
def bench() -> Bench:
    return Bench()


AHEAD = "100 drive=0.25; turns is ahead 0.25"


@sentences(
    {
        "it stands until it is commanded": "5000; turns is off; phase is still; reasons is ()",
        "it is driven both ways and let go": (
            f"{AHEAD}; 200 drive=-0.5; turns is back 0.5; 300 drive=0.0; turns is off; "
            "400 drive=0.25; turns is ahead 0.25; reasons is ()"
        ),
        "let go it is left alone": (
            f"{AHEAD}; 200 drive=0.0; turns is off; power cycle; 5000; turns is off; reasons is ()"
        ),
        "full voltage is a command": "100 drive=1.0; turns is ahead 1; 200 drive=-1.0; "
        "turns is back 1; reasons is ()",
        "a command during bring-up is kept": "5 drive=0.25; turns is off; 100; turns is ahead 0.25",
        "a command while outputs are disabled waits for them": (
            "switch; 100 drive=0.25; 500; turns is off; switch; 530; turns is ahead 0.25"
        ),
        "outputs enabled again before a refused stop was repeated obey the command": (
            f"{AHEAD}; refuse 1; switch; 130; consecutive is 1; switch; 300; turns is ahead 0.25"
        ),
        "a chip that lost its supply is found in a second and brought up": (
            f"{AHEAD}; power cycle; 1200; turns is ahead 0.25; consecutive is 1"
        ),
        "a fault after two commands that were taken is the first in a row": (
            f"{AHEAD}; refuse 1; 200 drive=0.5; 300; turns is ahead 0.5; 400 drive=0.25; 410; "
            "refuse 1; 500 drive=0.5; 600; turns is ahead 0.5; consecutive is 1 1"
        ),
        "a fault after one command that was taken is the second in a row": (
            f"{AHEAD}; refuse 1; 200 drive=0.5; 240; turns is ahead 0.5; "
            "refuse 1; 245 drive=0.25; 300; turns is ahead 0.25; consecutive is 1 2"
        ),
    }
)
def test_a_motor(bench: Bench, lines: str) -> None:
    bench.play(lines)


@sentences(
    {
        "0 brakes": f"{AHEAD}; 200 drive=0.0; turns is brake; 5000; turns is brake; reasons is ()",
        "its brake is off while outputs are disabled, and on again after that": (
            f"{AHEAD}; 200 drive=0.0; turns is brake; switch; 600; turns is off; switch; 900; "
            "turns is brake; reasons is ()"
        ),
    }
)
def test_a_motor_that_is_to_brake(lines: str) -> None:
    Bench(brakes=True).play(lines)


@pytest.mark.parametrize("drive", ["1.5", "-1.5", "nan", "inf"])
def test_a_command_that_is_none_switches_off_and_says_so(bench: Bench, drive: str) -> None:
    bench.play(AHEAD, f"200 drive={drive}; turns is off")
    assert bench.reasons == f"motor.drive: drive {drive}, expected -1 to 1; stopped"
    bench.play("300 drive=0.25; turns is ahead 0.25")


def test_a_motor_that_is_commanded_no_more_is_stopped_after_the_timeout() -> None:
    bench = Bench(timeout=SECOND // 2)
    bench.play(AHEAD, "599; turns is ahead 0.25; 600; turns is off; 5000; turns is off")
    assert bench.reasons == "motor: no command for 0.5 s; stopped"


@sentences(
    {
        "one kept while outputs are disabled is obeyed if it is young enough": (
            "switch; 100 drive=0.25; 560; switch; 590; turns is ahead 0.25; 600; turns is off; "
            "reasons is motor: no command for 0.5 s; stopped"
        ),
        "an older one is not": (
            "switch; 100 drive=0.25; 3000; switch; 3100; turns is off; 5000; turns is off; "
            "reasons is motor: no command for 0.5 s; stopped"
        ),
        "nor one before outputs were disabled": (
            f"{AHEAD}; switch; 3000; turns is off; switch; 3100; turns is off; 5000; turns is off; "
            "reasons is motor: no command for 0.5 s; stopped"
        ),
        "one that says to stand is never too old": (
            "switch; 100 drive=0.0; 3000; switch; 3100; turns is off; reasons is ()"
        ),
        "a newer one is obeyed": (
            "switch; 100 drive=0.25; 3000 drive=0.5; switch; 3100; turns is ahead 0.5; "
            "reasons is ()"
        ),
    }
)
def test_a_command_is_no_younger_for_having_waited(lines: str) -> None:
    bench = Bench(timeout=SECOND // 2)
    played, _, reasons = lines.partition("; reasons is ")
    bench.play(played)
    assert bench.reasons == reasons.replace("()", "")


def test_the_end_leaves_its_outputs_off_and_the_others_as_they_are(bench: Bench) -> None:
    bench.play(AHEAD)
    assert isinstance(bench.actuator, DcMotor)
    HBridge(bench.actuator.bridge.chip, 0, 1, 2).forward(0.5)
    assert bench.simulator.exit() == []
    assert bench.double.duties == (0.5, 1, *(0,) * 14)


def test_a_timeout_that_cannot_be_is_refused() -> None:
    with pytest.raises(SettingError, match=r"motor on H-bridge on channels 8, 9, 10 of PCA9685.*0"):
        Bench(timeout=0)
