"""Values that no longer come: what a pause is, and when it is too long."""

from types import SimpleNamespace
from typing import cast

import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.compass import Compass

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import HalError, Stuck
from firmware_runtime.lab.campaign import assert_sound, campaign
from firmware_runtime.lab.campaign.watched import Look, Watched
from firmware_runtime.lab.campaign.withheld import Gaps, longest_of, withheld


def test_what_sends_seldom_or_not_in_each_healthy_run_is_not_expected() -> None:
    first = {"often": 5, "seldom": 2 * SECOND, "once": 5}
    assert longest_of([first, {"often": 7, "seldom": 5}]) == {"often": 7}


@pytest.mark.parametrize(
    ("at_ms", "since_ms", "said"),
    [
        (1500, 0, None),  # as long as twice the longest pause and 0.3 s
        (1501, 0, "eyes has sent nothing for 0.5 s, 0.1 at the most when all is well"),
        (1501, 1400, None),  # outputs have not been on for so long
    ],
)
def test_a_pause_is_too_long_beyond_twice_the_longest_and_a_while(
    at_ms: int, since_ms: int, said: str | None
) -> None:
    usual, last = {"eyes": 100 * MILLISECOND}, {"eyes": SECOND}
    at, since = at_ms * MILLISECOND, since_ms * MILLISECOND
    assert withheld(usual, last, at, since) == said


def test_what_never_sent_is_missed_from_when_outputs_are_on() -> None:
    assert withheld({"eyes": 0}, {}, 2 * SECOND, SECOND) is not None
    assert withheld({"eyes": 0}, {}, 2 * SECOND, 1900 * MILLISECOND) is None


def test_a_field_may_be_none_until_its_driver_can_be_sure_that_it_hangs() -> None:
    usual = {"imu.sample": 0, "imu.sample.field": 100 * MILLISECOND}
    last = {"imu.sample": 4 * SECOND, "imu.sample.field": SECOND}
    assert withheld(usual, last, 3 * SECOND, 0) is None
    said = "imu.sample.field has sent nothing for 2 s, 0.1 at the most when all is well"
    assert withheld(usual, last, 3001 * MILLISECOND, 0) == said


def test_what_is_sent_for_the_first_time_was_waited_for_as_long_as_outputs_were_on() -> None:
    sent: dict[str, int] = {}
    watched = cast("Watched", SimpleNamespace(last_sent=lambda: sent))
    gaps = Gaps()
    for at, is_on in enumerate((False, True, True, True, True)):
        if at == 3:
            sent["eyes"] = 3
        gaps.look(Look(at, is_on=is_on, numbers=()), watched)
    assert gaps.longest == {"eyes": 3}  # since the last look with outputs off


@pytest.mark.slow
def test_a_round_of_the_detective_whose_sonar_on_the_body_sees_its_target_last_is_sound() -> None:
    campaign("detective", for_s=60.0, runs=6, workers=1).check()


@pytest.mark.slow
def test_a_compass_that_stands_still_and_says_so_is_sound_and_one_that_does_not_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    frozen = Strike("freeze", "body_compass", at_s=3.9007875)
    assert_sound("detective", [frozen])

    def forget(compass: Compass, error: HalError) -> None:
        if not isinstance(error, Stuck):
            note(compass, error)

    note = Compass.note
    monkeypatch.setattr(Compass, "note", forget)
    with pytest.raises(AssertionError, match=r"withheld of body_compass: .*heading_deg has sent"):
        assert_sound("detective", [frozen])


@pytest.mark.slow
def test_what_a_device_measured_comes_again_after_a_fault_that_was_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lie = Strike("wrong-byte", "imu", at_s=3.0, for_s=1.0, amount=15.0)
    assert_sound("tachobot", [lie])
    check = Mpu9250.check_magnetometer

    def check_and_give_up(chip: Mpu9250) -> bool:
        chip.has_magnetometer = check(chip)
        chip._start_decoding()
        return chip.has_magnetometer

    monkeypatch.setattr(Mpu9250, "check_magnetometer", check_and_give_up)
    said = r"unhealed of imu: .*\.imu\.sample\.field has sent nothing since then"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [lie])
