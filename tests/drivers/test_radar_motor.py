import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.radar_motor import RadarMotor, RadarMotorSettings

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import SettingError
from tests.support.pca9685_bench import Pca9685Bench
from tests.support.wire import sentences

PWM, IN1, IN2 = 8, 9, 10


class Radar(Pca9685Bench):
    """A radar motor on a PCA9685 double."""

    def __init__(self, longest_turn: int = NEVER, duty: float = 0.25) -> None:
        settings = RadarMotorSettings(duty=duty, frequency_hz=1000.0, longest_turn=longest_turn)
        super().__init__(
            lambda chip, interlock: RadarMotor(
                "motor1", HBridge(chip, PWM, IN1, IN2), settings, interlock
            )
        )

    @property
    def turns(self) -> str:
        """What PWM, IN1 and IN2 mean."""
        words: dict[tuple[float, ...], str] = {
            (0.25, 1, 0): "ahead",
            (0.25, 0, 1): "back",
            (1, 1, 1): "brake",
            (0, 0, 0): "off",
        }
        return words[self.double.duties[PWM : IN2 + 1]]

    @property
    def reasons(self) -> str:
        return " ".join(fault.reason for fault in self.faults)


@pytest.fixture
def radar() -> Radar:
    return Radar()


AHEAD = "100 turn=1; turns is ahead"


@sentences(
    {
        "signals turn both ways and brake": (
            f"{AHEAD}; 200 turn=2; turns is back; 300 turn=0; turns is brake; reasons is ()"
        ),
        "a signal during bring-up is kept": "5 turn=1; turns is off; 100; turns is ahead",
        "a silent chip is switched off again and again and then brought up": (
            f"{AHEAD}; refuse 3; 200 turn=2; 299; turns is ahead; 300; off is True; 400 turn=2; "
            "turns is back; consecutive is 1 2 3"
        ),
        "a chip that lost its supply is reported at the next signal and brought up": (
            f"{AHEAD}; power cycle; 200 turn=2; off is True; consecutive is 1; 400 turn=2; "
            "turns is back"
        ),
    }
)
def test_turning(radar: Radar, lines: str) -> None:
    radar.play(lines)


def test_a_signal_that_is_none_switches_off_and_says_so(radar: Radar) -> None:
    radar.play(AHEAD, "200 turn=3; off is True")
    assert "motor1.turn: signal 3, expected 0, 1 or 2" in radar.reasons


def test_each_signal_is_a_poll_of_two_and_one_burst_and_so_is_each_quarter_second_of_it(
    radar: Radar,
) -> None:
    radar.play("100")
    before = radar.bus.transactions
    radar.play("200 turn=1; 10000")
    assert radar.bus.transactions == before + 3 * (1 + 39)
    radar.play("10100 turn=0; 20000")
    assert radar.bus.transactions == before + 3 * (1 + 39) + 3 * (1 + 39)


def test_a_chip_that_is_reset_under_a_turning_head_is_found_in_a_second(radar: Radar) -> None:
    radar.play(AHEAD)
    radar.double.power_cycle()
    radar.play("1200; turns is ahead")
    assert "MODE1" in radar.reasons


@pytest.mark.parametrize("armed_again_at", [250, 400, 5000])
def test_a_head_that_braked_brakes_again_once_outputs_are_enabled_again(
    radar: Radar, armed_again_at: int
) -> None:
    radar.play("100 turn=0; 210; turns is brake; switch; 211")
    radar.double.power_cycle()  # as it is once its outputs were switched off
    radar.play(f"{armed_again_at}; turns is off; switch; {armed_again_at + 500}; turns is brake")


def test_a_chip_that_is_reset_under_a_head_that_brakes_is_found_in_a_second(radar: Radar) -> None:
    radar.play("100 turn=0; 210; turns is brake")
    radar.double.power_cycle()
    radar.play("1200; turns is brake")
    assert "MODE1" in radar.reasons


def test_a_head_that_was_switched_off_is_left_alone(radar: Radar) -> None:
    radar.play("100 turn=3; 210; off is True")
    before = radar.bus.transactions
    radar.play("20000; off is True")
    assert radar.bus.transactions == before


def test_a_head_that_turns_for_too_long_is_switched_off() -> None:
    radar = Radar(longest_turn=5 * SECOND)
    radar.play("1000 turn=1; 5999; turns is ahead; 6000; off is True")
    assert radar.reasons == "motor1: no command for 5 s; stopped"


def test_a_signal_that_waited_for_outputs_holds_for_as_long_as_one_that_did_not() -> None:
    radar = Radar(longest_turn=SECOND)
    radar.play("switch; 100 turn=1; 3000; turns is off; switch; 3100; turns is ahead")
    radar.play("3900; turns is ahead; 4100; off is True; consecutive is 1")


def test_a_turn_that_failed_and_is_written_again_is_no_younger_for_it() -> None:
    radar = Radar(longest_turn=SECOND)
    radar.play("100 turn=1; refuse 1; 800; turns is ahead; 1099; turns is ahead; 1101; off is True")
    assert [fault.kind for fault in radar.faults] == ["NoAcknowledge", "NotReady"]


def test_exit_leaves_all_channels_off(radar: Radar) -> None:
    radar.play(AHEAD)
    assert radar.simulator.exit() == []
    assert radar.double.all_off


@pytest.mark.parametrize(("duty", "longest_turn"), [(0.0, SECOND), (1.5, SECOND), (0.5, 0)])
def test_settings_that_cannot_be_are_refused(duty: float, longest_turn: int) -> None:
    with pytest.raises(SettingError, match=r"motor1 on H-bridge on channels 8, 9, 10 of PCA9685"):
        Radar(longest_turn, duty)
