"""Missions without faults in other settings, which their rig names, and what is wrong there."""

import pytest
from firmware_boards.tachobot.attitude import Attitude

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.campaign import campaign
from firmware_runtime.lab.campaign.again import assert_sound
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.without_faults import wrong_without_faults
from firmware_runtime.models.motion import Motion
from sim_doubles.rigs.tachobot import TachobotRig

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("anew")]
OTHER_WAY = "controller.yaw.reference_rad=-1.0"


@pytest.fixture
def turns_one_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """TachoBot's yaw ends at -0.5 rad to itself, which is right as long as it turns left."""
    estimate = Attitude._estimate

    def limited(attitude: Attitude, *asked: object) -> Motion:
        found: Motion = estimate(attitude, *asked)  # type: ignore[arg-type]
        return found._replace(position=max(found.position, -0.5))

    monkeypatch.setattr(Attitude, "_estimate", limited)


@pytest.mark.usefixtures("turns_one_way")
def test_what_is_wrong_in_another_setting_that_the_rig_names_is_found_there() -> None:
    (finding,) = campaign("tachobot", runs=3, workers=1).findings
    assert finding.mission.assignments == (OTHER_WAY,)
    assert finding.lines[1] == f"  no fault on tachobot --set {OTHER_WAY} --for 10"
    with pytest.raises(AssertionError, match=f"{finding.oracle} of {finding.model}"):
        assert_sound("tachobot", [], set={"controller.yaw.reference_rad": -1.0})


@pytest.mark.usefixtures("turns_one_way")
def test_a_mission_that_chooses_such_a_setting_is_run_in_its_own_alone() -> None:
    ahead = Mission(board="tachobot", assignments=("controller.yaw.reference_rad=1.2",))
    assert wrong_without_faults(ahead) is None


def test_an_oracle_of_a_campaign_judges_the_settings_of_its_mission_alone() -> None:
    def judge(rig: TachobotRig) -> str | None:
        yaw_rad = rig.world.state(rig.now()).yaw_rad
        return None if yaw_rad > -0.5 else "it turned the other way"

    assert wrong_without_faults(Mission(board="tachobot"), judge) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("also_in", "said"),
    [
        (("controller.yaw.reference=1.0",), "controller.yaw.reference=1.0: .*did you mean"),
        ("controller.yaw.reference_rad=-1.0", "also_in: .*expected"),
    ],
)
def test_a_setting_that_is_none_is_refused_by_the_part_that_names_it(
    monkeypatch: pytest.MonkeyPatch, also_in: object, said: str
) -> None:
    monkeypatch.setattr(TachobotRig, "also_in", also_in)
    with pytest.raises(ConfigError, match=said) as caught:
        campaign("tachobot", for_s=0.5, runs=1, workers=1)
    assert "its rig" in str(caught.value)
