"""Runs that go on to the end of their mission: which they are, and what is found there."""

from itertools import islice

import pytest
from firmware_boards.detective.mission import Mission as DetectiveMission
from firmware_drivers.treads import Treads

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.hal.strike import KINDS, Strike
from firmware_runtime.lab.campaign.again import assert_sound
from firmware_runtime.lab.campaign.courses import as_states_change, in_courses
from firmware_runtime.lab.campaign.findings import findings_of, text_of_test
from firmware_runtime.lab.campaign.going_on import going_on
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.space import space_of
from firmware_runtime.lab.campaign.trial import Trial, alone, trial_of
from firmware_runtime.lab.campaign.watched import EVERY
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.runs.fault_test import sources_of
from sim_doubles.rigs.tachobot import TachobotRig
from tests.support.truth_aside import truth_aside

pytestmark = pytest.mark.usefixtures("anew")
MISSION = Mission(board="tachobot", for_s=3.0)
SILENCE = Strike("nack", "imu", at_s=1.2, for_s=0.2)


@pytest.mark.slow
def test_one_run_of_each_fault_that_is_over_soon_or_lasts_goes_on_those_of_people_first() -> None:
    space = space_of(MISSION)
    chosen = list(islice(in_courses(space), 600))
    found = going_on(space, chosen)
    strikes = [space[number].strikes[0] for number in chosen if number in found]
    faults = [(each.kind, each.device, each.span == NEVER) for each in strikes]
    assert len(set(faults)) == len(faults) >= 600 // 24
    assert {lasts for _, _, lasts in faults} == {True, False}
    ends = [each.at + (0 if each.span == NEVER else each.span) for each in strikes]
    assert all(end <= 1_500_000_000 for end in ends)
    of_people = {each.name for each in KINDS.values() if each.of == "people"}
    assert of_people & {each.kind for each in strikes}
    assert going_on(space, chosen[:100]) < found


@pytest.mark.slow
def test_a_robot_that_is_well_again_and_has_given_up_what_it_is_for_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert_sound("tachobot", [SILENCE], for_s=3.0, goes_on=True)

    def missed(rig: TachobotRig) -> str | None:
        was_struck = any(bus.struck_at is not None for bus in rig.buses.values())
        return "its yaw is nowhere" if was_struck else None

    monkeypatch.setattr(TachobotRig, "missed", missed)
    assert_sound("tachobot", [SILENCE], for_s=3.0)
    said = r"missed of imu: its yaw is nowhere, 7\.6 s after the fault was over"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [SILENCE], for_s=3.0, goes_on=True)
    row = alone(Trial(MISSION, (SILENCE,), goes_on=True), 7)
    assert trial_of(row).goes_on
    (finding,) = findings_of([row], None)
    assert (finding.oracle, finding.goes_on) == ("missed", True)
    assert finding.faults == (Strike("nack", "imu", at_s=1.2, for_s=0.0),)


@pytest.mark.slow
def test_a_fault_that_lasts_may_show_in_nothing_until_much_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    slow = Strike("slow", "imu", at_s=1.2)

    def has_crept(rig: TachobotRig) -> bool:
        return rig.now() > 6 * SECOND and any(bus.struck_at for bus in rig.buses.values())

    assert_sound("tachobot", [slow], for_s=3.0, goes_on=True)
    monkeypatch.setattr(TachobotRig, "truth", truth_aside(has_crept))
    assert_sound("tachobot", [slow], for_s=3.0)
    with pytest.raises(AssertionError, match="silent of imu: "):
        assert_sound("tachobot", [slow], for_s=3.0, goes_on=True)


@pytest.mark.slow
def test_a_robot_that_is_lost_is_put_back_and_goes_on_in_any_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lie = Strike("swap", "imu", at_s=1.15, for_s=1.0, amount=2.0)
    assert_sound("balancing", [lie])
    monkeypatch.setattr("balancing.tilt.AT_REST", 1)  # its pitch comes back no faster as it lies
    with pytest.raises(AssertionError, match=r"missed of imu: it was put back .* it has fallen"):
        assert_sound("balancing", [lie])


@pytest.mark.slow
def test_a_mission_that_ends_when_all_is_well_ends_after_a_fault_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fault = Strike("nack", "body_compass", at_s=3.0, for_s=0.3)
    assert_sound("detective", [fault], for_s=30.0, goes_on=True)
    judge = DetectiveMission._judge

    def forget(mission: DetectiveMission) -> object:
        mission.forgets = getattr(mission, "forgets", False) or bool(mission.fault)  # type: ignore[attr-defined]
        return None if mission.forgets else judge(mission)  # type: ignore[attr-defined]

    monkeypatch.setattr(DetectiveMission, "_judge", forget)
    said = r"missed of body_compass: its mission has not ended, which it does after 34\.\d s"
    with pytest.raises(AssertionError, match=said):
        assert_sound("detective", [fault], for_s=30.0, goes_on=True)


@pytest.mark.slow
def test_a_count_that_is_not_reset_shows_by_a_fault_that_comes_again_and_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mission = Mission(board="detective", for_s=12.0)
    space = space_of(mission)
    numbers = {
        (space[n].strikes[0].kind, space[n].strikes[0].device): n
        for n in range(space.singles, len(space))
    }
    strikes = space[numbers["brown-out", "treads"]].strikes
    assert len(strikes) > 5
    assert strikes == strikes[0].again(len(strikes), every_s=1.5)
    assert_sound("detective", strikes, for_s=12.0)
    monkeypatch.setattr(Treads, "has_acted", lambda _treads: False)
    row = alone(Trial(mission, strikes))
    assert (row["outcome"], row["model"]) == ("unhealed", "treads")
    (finding,) = findings_of([row], None)
    assert finding.kind == "brown-out again and again"
    assert 3 <= len(finding.faults) < len(strikes)
    (script,) = sources_of(finding.faults)
    assert script.startswith('*Strike("brown-out", "treads", at_s=0.5')
    assert script.endswith(f".again({len(finding.faults)}, every_s=1.5)")
    assert f"    {script},\n]" in text_of_test(finding, "test_it")
    assert len(finding.lines) == 3
    assert str(finding.said).startswith("treads: ")
    assert f" s, {finding.said} reported after " in finding.lines[2]


@pytest.mark.slow
def test_what_comes_again_and_again_is_spread_among_the_others_and_all_of_it_in_the_whole() -> None:
    space = space_of(Mission(board="tachobot"))
    series = range(space.singles, space.pairs_from)
    assert len(series) > 20
    chosen = list(in_courses(space, 400))
    assert len(set(chosen)) == 400
    assert len(set(chosen) & set(series)) == 400 // 33
    assert set(series) <= set(in_courses(space))


@pytest.mark.slow
def test_what_people_do_as_a_state_changes_goes_on_to_the_end_and_comes_soon() -> None:
    space = space_of(Mission(board="detective"))
    around = as_states_change(space)
    strikes = [space[number].strikes[0] for number in around]
    assert {each.kind for each in strikes} == {"disarm", "reload"}
    assert not [each for each in strikes if each.for_s is None and each.kind == "disarm"]
    taken = space.found.taken
    (heard,) = (
        look
        for look in range(1, len(taken))
        for arrow in taken[look] - taken[look - 1]
        if arrow.endswith("sonar1: Listen -> Report object")
    )
    looks = {space[number].before // EVERY for number in around}
    assert {heard - 3, heard - 2, heard - 1, heard} <= looks
    chosen = list(in_courses(space, 1000))
    assert len(set(chosen)) == 1000
    assert set(around) <= set(chosen)
    assert set(around) <= going_on(space, chosen)
    assert sorted(in_courses(space)) == list(range(len(space)))


@pytest.mark.slow
def test_what_a_model_keeps_of_a_state_that_it_has_left_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disarmed = [Strike("disarm", at_s=5.1626775, for_s=3.0)]
    assert_sound("detective", disarmed, goes_on=True)

    def enter_and_keep(diagram: StateDiagram, state: str) -> None:
        diagram.hold_in(state, diagram.durations[state])
        diagram._follow_applied(diagram.applied)
        if diagram.watch is not None:
            diagram.watch(state)

    monkeypatch.setattr(StateDiagram, "_enter", enter_and_keep)
    assert_sound("detective", disarmed)
    with pytest.raises(AssertionError, match="no arrow's condition holds"):
        assert_sound("detective", disarmed, goes_on=True)
