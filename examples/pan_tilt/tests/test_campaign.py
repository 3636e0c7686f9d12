"""A minute of the head, struck by single faults at any moment: none breaks it."""

from collections.abc import Iterator

import pytest

from firmware_runtime.hal.strike import Strike
from firmware_runtime.lab.campaign import campaign
from firmware_runtime.lab.campaign.again import assert_sound
from firmware_runtime.lab.campaign.healthy import healthy


@pytest.fixture
def planted(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Plants a mistake; no healthy run of it is kept."""
    healthy.cache_clear()
    yield monkeypatch
    healthy.cache_clear()


@pytest.mark.slow
def test_no_single_fault_breaks_the_head() -> None:
    campaign("pan_tilt", for_s=60.0, runs=8, workers=1).check()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("pan_tilt.wiring.INPUTS", ("AIN0", "AIN2", "AIN1", "AIN3"), "beside its light"),
        ("firmware_runtime.models.pid.SECOND", 1_000_000, "turns to and fro"),
    ],
)
def test_a_head_that_does_not_follow_is_wrong_without_any_fault(
    planted: pytest.MonkeyPatch, name: str, value: object, says: str
) -> None:
    planted.setattr(name, value)
    (found,) = campaign("pan_tilt", runs=1, workers=1).findings
    assert found.oracle == "missed"
    assert says in found.what


@pytest.mark.slow
@pytest.mark.parametrize(
    "strike",
    [
        pytest.param(Strike("weak", "servos", at_s=4.825, for_s=1.0, amount=4742.0), id="weak"),
        pytest.param(Strike("weak", "servos", at_s=0.0897775, for_s=1.0), id="weak at the start"),
        pytest.param(Strike("dead", "servos", at_s=5.845, amount=5762.0), id="dead"),
    ],
)
def test_a_servo_that_is_told_to_turn_to_its_end_and_does_not_is_reported(strike: Strike) -> None:
    assert_sound("pan_tilt", [strike], for_s=10.0)
