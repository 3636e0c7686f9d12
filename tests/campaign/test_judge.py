"""What the judge of a campaign finds: a mistake each in TachoBot or its rig, and what is sound."""

from functools import partial
from itertools import count
from math import inf, nan

import pytest
from firmware_boards.detective.mission import Mission as DetectiveMission
from firmware_boards.detective.turning import VehicleTurn
from firmware_boards.tachobot import allocation
from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.attitude import Attitude
from firmware_boards.tachobot.controller import Controller
from firmware_boards.tachobot.settings import TachobotSettings
from firmware_drivers import hardware
from firmware_drivers.chips import ak8963, mpu9250
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.liveness import Liveness
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.dc_motor import BridgeMotor
from firmware_drivers.hardware import HardwareModel
from firmware_drivers.imu import Imu
from firmware_drivers.motors import Motors
from firmware_drivers.sonar import Sonar
from firmware_drivers.thrust_pairs import ThrustPairs
from firmware_drivers.treads import Treads
from firmware_drivers.wheel_check import WheelCheck
from msgspec.structs import replace
from pan_tilt.rig import PanTiltRig

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.outcome import SwitchOffRetry
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import HalError, NotReady
from firmware_runtime.lab.campaign import campaign
from firmware_runtime.lab.campaign.again import assert_sound
from firmware_runtime.lab.campaign.cause import Cause
from firmware_runtime.lab.campaign.healthy import Healthy, healthy
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.recovery import Recovery
from firmware_runtime.lab.campaign.space import space_of
from firmware_runtime.lab.campaign.trial import Trial, alone
from firmware_runtime.lab.campaign.watched import EVERY, Watched
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid
from sim_doubles.rigs.detective import DetectiveRig
from sim_doubles.rigs.tachobot import TachobotRig
from tests.support.truth_aside import truth_aside

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("anew")]
BROKEN = (("weak", "thrust_pairs"), ("slow", "imu"))
SILENT_IMU = Strike("nack", "imu", at_s=2.0, for_s=0.2)


def found_without_fault(for_s: float) -> str:
    """Return the first line of a campaign's only finding, for which nothing was struck."""
    report = campaign("tachobot", for_s=for_s, runs=5, workers=1)
    (finding,) = report.findings
    assert (finding.faults, report.runs) == ((), 0)
    return finding.lines[0]


def test_outputs_that_nothing_commands_any_more_are_found_whatever_was_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("nack", "imu", at_s=1.2)
    assert_sound("tachobot", [silence], for_s=1.5)

    def settle(model: ThrustPairs) -> None:
        model.passivate("driving")

    monkeypatch.setattr(ThrustPairs, "settle", settle)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"on of imu: imu fails for 0\.06 s, and it is driven"):
        assert_sound("tachobot", [silence], for_s=1.5)
    healthy.cache_clear()
    monkeypatch.setattr(TachobotRig, "off_within_s", {})
    with pytest.raises(AssertionError, match=r"held of imu: for 0\.25 s outputs have been on"):
        assert_sound("tachobot", [silence], for_s=1.5)


def test_a_robot_that_drives_on_though_a_check_of_it_has_reported_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = Strike("hold", at_s=1.0)
    assert_sound("tachobot", [held], for_s=1.5)

    def external(model: Allocation, elapsed: int) -> None:
        model.moves.clear()
        answered(model, elapsed)

    answered = Allocation.external
    monkeypatch.setattr(Allocation, "external", external)
    healthy.cache_clear()
    said = "on of world: controller.movement_check reported a fault 0.1 s ago, and it is driven on"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [held], for_s=1.5)


def test_of_two_faults_one_that_drives_by_itself_is_no_driving_on() -> None:
    blind, full = (
        Strike("absent", "imu", at_s=7.85),
        Strike("full-on", "thrust_pairs", at_s=8.0005925),
    )
    assert_sound("tachobot", [blind, full], seed=7)


def test_of_two_chips_that_drive_the_one_that_works_is_judged_while_the_other_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    dead = Strike("absent", "radar_motor", at_s=1.0)
    assert_sound("detective", [dead], for_s=2.0)

    def judge(mission: DetectiveMission) -> object:
        others = [each for each in mission.fault if "0x40" not in each.reason]
        mission.fault.clear()
        mission.fault.extend(others)
        return judged(mission)

    judged = DetectiveMission._judge
    monkeypatch.setattr(DetectiveMission, "_judge", judge)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"on of radar_motor: radar_motor fails for 0\.7 s"):
        assert_sound("detective", [dead], for_s=2.0)


def test_one_wrong_byte_of_what_a_driver_of_treads_says_ends_no_mission(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wrong = Strike("wrong-byte", "treads", at_s=2.02, for_s=0.0, amount=15414.0)
    assert_sound("detective", [wrong], for_s=3.0)
    monkeypatch.setattr(WheelCheck, "is_unasked", lambda _check, *_counts: False)
    with pytest.raises(AssertionError, match="unhealed of treads: the fault was over at once"):
        assert_sound("detective", [wrong], for_s=3.0)


def test_a_report_of_a_robot_that_was_disarmed_and_no_more_is_invented(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disarmed = Strike("disarm", at_s=7.75, for_s=3.0)
    assert_sound("detective", [disarmed], for_s=8.0)
    assert_sound("balancing", [disarmed], for_s=8.0)  # it falls, and its gyro says so

    def take_commands(model: VehicleTurn) -> None:
        taken(model)
        model.applied.clear()
        model._is_applied = True

    taken = VehicleTurn.take_commands
    monkeypatch.setattr(VehicleTurn, "take_commands", take_commands)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"invented .* turn_check reports Implausible \("):
        assert_sound("detective", [disarmed], for_s=8.0)


def test_a_robot_that_may_go_on_by_itself_though_its_fault_lasts_is_watched_until_it_has_recovered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blind = Strike("nack", "eyes", at_s=2.0)
    assert_sound("pan_tilt", [blind], for_s=2.5)
    monkeypatch.setattr(Healthy, "reached_by", lambda _found, _at: frozenset())
    sure_after = alone(Trial(Mission(board="pan_tilt", for_s=2.5), (blind,)))["known_at_s"]
    assert sure_after == pytest.approx(2.0 + PanTiltRig.recovered_within_s, abs=0.1)


def test_a_driving_chip_that_is_cut_off_holds_its_outputs_and_that_is_no_mistake() -> None:
    assert_sound("tachobot", [Strike("nack", "thrust_pairs", at_s=1.2, for_s=2.0)], for_s=1.5)
    assert_sound("tachobot", [Strike("stuck", "i2c1", at_s=1.2)], for_s=1.5)


def test_a_robot_that_says_what_is_wrong_and_is_driven_away_by_it_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    offset = Strike("offset", "imu", at_s=6.0, amount=5.0)
    assert_sound("tachobot", [offset], for_s=6.5)

    def external(model: Attitude, elapsed: int) -> None:
        model.trusted.clear()
        believed(model, elapsed)

    believed = Attitude.external
    monkeypatch.setattr(Attitude, "external", external)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"on of imu: controller\.heading_check has reported"):
        assert_sound("tachobot", [offset], for_s=6.5)
    monkeypatch.setattr(TachobotRig, "ends_within_s", {})
    healthy.cache_clear()
    with pytest.raises(AssertionError, match="astray of imu: 5 s after it was reported"):
        assert_sound("tachobot", [offset], for_s=6.5)


def test_a_robot_that_takes_another_angle_for_its_own_afterwards_is_astray(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("nack", "imu", at_s=6.0, for_s=1.0)
    assert_sound("tachobot", [silence], for_s=6.5)

    def mistaken(model: Attitude, sample: InertialSample, elapsed: int) -> Motion:
        if elapsed > SECOND // 2:
            model._heading_at_zero -= 0.5
        return estimate(model, sample, elapsed)

    estimate = Attitude._estimate
    monkeypatch.setattr(Attitude, "_estimate", mistaken)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match="astray of imu: 5 s after the fault"):
        assert_sound("tachobot", [silence], for_s=6.5)


def test_a_rig_says_how_soon_its_robot_is_healthy_again(monkeypatch: pytest.MonkeyPatch) -> None:
    silence = Strike("nack", "imu", at_s=1.2, for_s=0.5)
    assert_sound("tachobot", [silence], for_s=1.5)
    assert_sound("tachobot", [Strike("brown-out", "thrust_pairs", at_s=2.0605925)])
    monkeypatch.setattr(hardware, "RETRY_AFTER", 3 * SECOND)
    with pytest.raises(AssertionError, match=r"unhealed of imu: 2\.2 s after the fault outputs"):
        assert_sound("tachobot", [silence], for_s=1.5)


def test_a_chip_that_stays_off_while_another_one_drives_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disarmed = Strike("disarm", at_s=5.3, for_s=3.0)
    assert_sound("detective", [disarmed], for_s=5.5)
    monkeypatch.setattr(BridgeMotor, "settle", Motors.settle)  # what brakes is left alone
    healthy.cache_clear()
    with pytest.raises(AssertionError, match="5 s after the fault radar_motor is off, which never"):
        assert_sound("detective", [disarmed], for_s=5.5)


def test_a_robot_that_is_told_to_drive_and_whose_output_is_broken_is_driven(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    weak, slow = (Strike(kind, device, at_s=1.2) for kind, device in BROKEN)
    assert_sound("tachobot", [weak], for_s=1.5)
    # by what its outputs do, not by what they are told
    monkeypatch.setattr(TachobotRig, "is_driven", property(lambda rig: rig.now() < 1.2 * SECOND))
    monkeypatch.setattr(TachobotRig, "truth", truth_aside(lambda rig: rig.now() > 2 * SECOND))
    assert_sound("tachobot", [slow], for_s=1.5)
    with pytest.raises(AssertionError, match="silent of thrust_pairs: "):
        assert_sound("tachobot", [weak], for_s=1.5)


def test_a_sonar_that_is_dead_from_its_first_ranging_keeps_the_mission_from_its_start() -> None:
    assert_sound("detective", [Strike("nack", "radar_sonar", at_s=0.07665, for_s=1.0)], for_s=5.5)


def test_a_run_that_ends_of_a_fault_that_was_over_at_once_is_not_healed_where_its_rig_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    moment = Strike("brown-out", "treads", at_s=5.37)
    assert_sound("detective", [moment], for_s=5.5)

    def write_stop(model: Treads) -> None:
        model.driver.stop()  # and the check of its wheels goes on from before

    monkeypatch.setattr(Treads, "write_stop", write_stop)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match="unhealed of treads: the fault was over at once, and"):
        assert_sound("detective", [moment], for_s=5.5)
    monkeypatch.setattr(DetectiveRig, "healed_within_s", None)
    healthy.cache_clear()
    assert_sound("detective", [moment], for_s=5.5)


def test_a_robot_that_does_not_do_what_it_is_for_is_found_and_not_struck(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    answer = Pid._answer

    def halved(model: Pid, motion: Motion, seconds: float) -> float:
        return answer(model, Motion(motion.position / 2, motion.rate), seconds)

    monkeypatch.setattr(Pid, "_answer", halved)
    assert found_without_fault(3.0).startswith("missed of world: its yaw is 2")


def test_what_is_wrong_in_another_world_alone_says_in_which(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, *_, last = (seed or 0 for seed in Mission(board="tachobot").seeds(4))

    def judge(rig: TachobotRig) -> str | None:
        return "it is unlucky" if rig._settings.world.seed == last else None

    monkeypatch.setattr(TachobotRig, "judge", judge, raising=False)
    (finding,) = campaign("tachobot", for_s=0.5, runs=5, workers=1).findings
    assert last != own
    assert f"--seed {last}" in finding.lines[1]


def test_a_robot_that_rests_later_than_healthy_ones_is_healed_and_one_that_gives_up_is_not() -> (
    None
):
    known = healthy(Mission(board="tachobot", for_s=3.0))
    cause = Cause([SILENT_IMU], {"imu": ["imu"]})
    with Mission(board="tachobot", for_s=3.0).opened() as robot:
        watched = Watched(robot)
        watched.go_on(to=cause.end)
        recovery = Recovery(watched, known, cause)
        look = watched.look()

        def said(*on_and_off: tuple[bool, float]) -> str | None:
            at, found = cause.end, None
            for is_on, for_s in on_and_off:
                for _ in range(round(for_s * SECOND) // EVERY):
                    at += EVERY
                    found = recovery.judge(replace(look, at=at, is_on=is_on)) or found
            return None if found is None else found[1]

        assert said((False, 2.0), (True, 0.2), (False, 2.0), (True, 0.2)) is None
        found = said((True, 0.2), (False, 2.4))
    assert found == "2.2 s after they were last on outputs are off"


def test_a_robot_that_goes_on_later_than_at_once_has_as_long_from_then_on_to_find_its_way() -> None:
    known = healthy(Mission(board="tachobot", for_s=3.0))
    cause = Cause([SILENT_IMU], {"imu": ["imu"]})
    with Mission(board="tachobot", for_s=3.0).opened() as robot:
        watched = Watched(robot)
        watched.go_on(to=cause.end)
        recovery, look = Recovery(watched, known, cause), watched.look()
        elsewhere = replace(look, numbers=tuple(9.0 for _ in look.numbers))

        def found_after(off_s: float) -> float:
            at = cause.end
            for k in range(1, 1000):
                at = cause.end + k * EVERY
                is_on = k * EVERY > off_s * SECOND
                if recovery.judge(replace(elsewhere, at=at, is_on=is_on)) is not None:
                    break
            return (at - cause.end) / SECOND

        assert found_after(2.0) == pytest.approx(7.0, abs=0.05)


def test_a_push_that_its_rig_says_it_bears_ends_no_run_and_leaves_it_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pushed = Strike("push", at_s=6.1)  # while it turns to its target: the compass contradicts that
    assert_sound("detective", [pushed])
    monkeypatch.setattr(DetectiveRig, "bears_push", 1.0, raising=False)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match="unhealed of world: it was pushed by no more than it"):
        assert_sound("detective", [pushed])
    assert_sound("detective", [replace(pushed, amount=1.5)])
    healthy.cache_clear()

    def lost(rig: TachobotRig) -> str | None:
        return "it lies" if rig.world.state(rig.now()).yaw_rate_rad_s > 1.5 else None

    monkeypatch.setattr(TachobotRig, "lost", lost, raising=False)
    shoved = [Strike("push", at_s=2.0, amount=1.0)]
    with pytest.raises(AssertionError, match=r"unhealed of world: it was pushed .*, and it lies"):
        assert_sound("tachobot", shoved, for_s=3.0)
    assert_sound("tachobot", [Strike("push", at_s=0.5, amount=1.0)], for_s=3.0)
    healthy.cache_clear()


def test_a_report_of_the_step_in_which_it_is_struck_is_of_that_strike() -> None:
    stuck = Strike("stuck", "esc", at_s=3.0505925, for_s=0.0)
    assert_sound("tachobot", [stuck], for_s=5.0, set={"controller.mode": "free"})


def test_a_motor_that_cannot_be_reached_is_driven_on_without_a_device_that_fails() -> None:
    stuck, silent = (
        Strike("stuck", "thrust_pairs", at_s=1.2, for_s=1.0),
        Strike("nack", "imu", at_s=1.25, for_s=1.0),
    )
    assert_sound("tachobot", [stuck, silent], for_s=3.0)
    weak = Strike("weak", "thrust_pairs", at_s=1.2)
    assert Cause([weak, silent], {"thrust_pairs": ["thrust_pairs"]}).out_of_reach_until == 0


def test_a_sensor_that_is_believed_again_though_it_stands_still_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    frozen = Strike("freeze-axis", "imu", at_s=1.5, amount=3.0)
    assert_sound("tachobot", [frozen], for_s=3.0)
    refused = Strike("nack", "imu", at_s=1.2, for_s=0.2)
    assert_sound("tachobot", [refused, frozen], for_s=3.0)  # that it reports before is of another
    restart = Liveness.restart

    def forget(liveness: Liveness) -> None:
        restart(liveness)
        liveness._forget_runs()

    monkeypatch.setattr(Liveness, "restart", forget)
    said = "on of imu: imu reported Stuck, is as it was, and drives it again"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [frozen], for_s=3.0)


def test_a_run_that_ends_amid_a_fault_tries_on_to_switch_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out_of_reach = Strike("nack", "thrust_pairs", at_s=1.5)
    assert_sound("tachobot", [out_of_reach], for_s=3.0)
    monkeypatch.setattr(SwitchOffRetry, "run", SwitchOffRetry._attempt)
    said = "on of thrust_pairs: at the end not made safe: i2c1 0x40: not acknowledged"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [out_of_reach], for_s=3.0)


def test_a_robot_that_is_driven_on_by_what_reports_again_and_again_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    dead, far = [Strike("dead", "treads", at_s=1.0, amount=1.0)], {"world.target": [6.0, 6.0]}
    assert_sound("detective", dead, set=far)
    monkeypatch.setattr(Treads, "has_acted", lambda _: True)  # no fault is one in a row
    with pytest.raises(AssertionError, match="on of treads: treads has reported again and again"):
        assert_sound("detective", dead, set=far)


def test_a_check_that_reports_now_and_then_of_a_robot_that_stays_where_it_is_is_no_driving_on() -> (
    None
):
    assert_sound("tachobot", [Strike("noise", "imu", at_s=9.37, amount=6.0)])


def test_a_robot_that_is_driven_on_without_what_a_sensor_no_longer_measures_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unheard = Strike("zero", "body_sonar", at_s=3.0)
    assert_sound("detective", [unheard])
    pinged = Sonar._ping

    def ping(sonar: Sonar) -> None:
        pinged(sonar)
        sonar.consecutive_faults = 0

    monkeypatch.setattr(Sonar, "_ping", ping)
    healthy.cache_clear()
    said = "on of body_sonar: body_sonar has reported, and sent nothing, for 1.2 s, and it is drive"
    with pytest.raises(AssertionError, match=said):
        assert_sound("detective", [unheard])


def test_settings_that_are_taken_up_as_they_are_and_move_the_robot_are_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reload = Strike("reload", at_s=1.2)
    assert_sound("tachobot", [reload], for_s=1.5, goes_on=True)
    retuned = Controller.retune

    def retune(controller: Controller, settings: TachobotSettings) -> None:
        retuned(controller, settings)
        controller.yaw.integral_n = 0.0

    monkeypatch.setattr(Controller, "retune", retune)
    healthy.cache_clear()
    said = "changed of world: it took up its settings as they are, and tachobot.world.yaw"
    with pytest.raises(AssertionError, match=said):
        assert_sound("tachobot", [reload], for_s=1.5)


def test_an_oracle_of_its_rig_is_not_asked_of_outputs_that_are_out_of_reach_for_good() -> None:
    spinning = Strike("full-on", "thrust_pairs", at_s=0.04792, amount=0.0)
    assert_sound("tachobot", [spinning], goes_on=True)


def test_what_goes_wrong_later_than_the_mission_is_found_and_not_struck(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def judge(rig: TachobotRig) -> str | None:
        return "it is late" if rig.now() > 40 * SECOND else None

    monkeypatch.setattr(TachobotRig, "judge", judge, raising=False)
    assert found_without_fault(0.5) == "own of world: it is late, and no fault was made"
    with pytest.raises(AssertionError, match="own of world: it is late"):
        assert_sound("tachobot", [], for_s=0.5)


def test_a_robot_that_never_drives_anything_is_found_and_not_struck(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Attitude, "output", lambda _: None)
    assert found_without_fault(0.5) == "idle of world: no output is ever on, and no fault was made"


def test_what_pushes_the_wrong_way_is_found_by_the_robot_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    a, b, c, d = allocation._TURNS
    monkeypatch.setattr(allocation, "_TURNS", (a, b, d, c))
    assert found_without_fault(0.5).startswith("invented of controller.movement_check")


def test_a_chip_that_is_not_used_as_its_data_sheet_says_is_found_and_not_struck(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mpu9250, "RESET_NS", 100_000)
    found = found_without_fault(1.5)
    assert found.startswith("misused of imu: MPU-9250 0x68: register 0x6b written during")


def test_a_control_at_half_its_rate_is_found_and_not_struck(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    send, calls = Attitude.output, count()

    def every_second(model: Attitude) -> None:
        if next(calls) % 2:
            send(model)

    monkeypatch.setattr(Attitude, "output", every_second)
    found = found_without_fault(3.0)
    assert found.startswith("paced of i2c1: it has 152 transactions a second at the most")
    assert "and 200 by its board's loads" in found
    healthy.cache_clear()
    monkeypatch.setattr(TachobotRig, "unpaced", ("i2c1",), raising=False)
    assert healthy(Mission(board="tachobot", for_s=3.0)).wrong is None


def test_a_robot_is_pushed_both_ways() -> None:
    space = space_of(Mission(board="tachobot", for_s=0.3))
    pushes = {each.strikes[0].amount for each in space if each.strikes[0].kind == "push"}
    assert pushes == {None, -1.0}


def test_a_motor_that_is_disarmed_and_brakes_is_not_off(monkeypatch: pytest.MonkeyPatch) -> None:
    disarmed = Strike("disarm", at_s=4.0)
    assert_sound("balancing", [disarmed], for_s=4.5)
    monkeypatch.setattr(HBridge, "stop", HBridge.brake)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"on of world: it was disarmed 0\.5 s ago"):
        assert_sound("balancing", [disarmed], for_s=4.5)


@pytest.mark.parametrize("kind", ["nack", "absent"])
def test_a_device_that_fails_and_is_not_named_is_found(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    silence = Strike(kind, "imu", at_s=1.2)

    def note(_model: Imu, _error: object) -> None:
        """Swallow it."""

    monkeypatch.setattr(Imu, "note", note)
    with pytest.raises(AssertionError, match="late of imu: imu fails at each use, and only others"):
        assert_sound("tachobot", [silence], for_s=1.5)


def test_a_robot_that_is_off_while_a_device_fails_has_a_second_to_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def note(_model: Imu, _error: object) -> None:
        """Swallow it."""

    monkeypatch.setattr(Imu, "note", note)
    monkeypatch.setattr(ThrustPairs, "drive_on", ThrustPairs.stop)
    assert_sound("tachobot", [Strike("nack", "imu", at_s=7.0, for_s=0.5)], for_s=7.5)
    with pytest.raises(AssertionError, match="mute of imu: outputs have been off for 1 s, and are"):
        assert_sound("tachobot", [Strike("nack", "imu", at_s=7.0, for_s=2.0)], for_s=7.5)


def test_a_device_that_is_not_used_while_it_fails_need_not_be_reported() -> None:
    unseen, unused = (
        Strike("ones", "imu", at_s=2.08, for_s=1.0),
        Strike("absent", "thrust_pairs", at_s=2.6305925, for_s=1.0),
    )
    assert_sound("tachobot", [unseen, unused], for_s=3.0)


def test_of_two_faults_each_has_its_own_time_to_be_reported() -> None:
    once, later = (
        Strike("nack", "imu", at_s=1.0, for_s=0.0),
        Strike("nack", "imu", at_s=1.9, for_s=1.0),
    )
    assert_sound("tachobot", [once, later], for_s=3.0)


def test_a_device_is_named_by_a_sentence_and_by_whole_words_within_the_stated_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("nack", "imu", at_s=1.2)

    def note(_model: Imu, _error: object) -> None:
        """Swallow it."""

    monkeypatch.setattr(Imu, "note", note)
    monkeypatch.setattr(TachobotRig, "off_within_s", {})
    for reason, is_named in (("no forces by the imu", True), ("no forces, minimum", False)):

        def drive_on(model: ThrustPairs, reason: str = reason) -> None:
            HardwareModel.note(model, NotReady(reason, where="thrust"))
            model.stop()

        monkeypatch.setattr(ThrustPairs, "drive_on", drive_on)
        healthy.cache_clear()
        if is_named:
            assert_sound("tachobot", [silence], for_s=1.5)
        else:
            with pytest.raises(AssertionError, match="late of imu: imu fails at each use"):
                assert_sound("tachobot", [silence], for_s=1.5)


def test_values_that_are_sent_on_though_the_device_has_failed_are_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("nack", "imu", at_s=1.2)
    send, last = Imu.output, list[InertialSample]()

    def output(model: Imu) -> None:
        send(model)
        if model.faults and last:
            model.sample.send(last[-1])
        elif model._sample is not None:
            last.append(model._sample)

    monkeypatch.setattr(Imu, "output", output)
    stale = r"stale of imu: tachobot\.imu\.sample has sent 3 values since imu answered last"
    with pytest.raises(AssertionError, match=stale):
        assert_sound("tachobot", [silence], for_s=1.5)
    with pytest.raises(AssertionError, match=stale.replace("of imu", "of i2c1")):
        assert_sound("tachobot", [Strike("fault", "i2c1", at_s=1.2)], for_s=1.5)


@pytest.mark.parametrize(("number", "is_sound"), [(inf, True), (-inf, False), (nan, False)])
def test_infinity_is_what_a_device_says_that_has_nothing_in_range(
    monkeypatch: pytest.MonkeyPatch, number: float, *, is_sound: bool
) -> None:
    send = ThrustPairs.output

    def output(model: ThrustPairs) -> None:
        send(model)
        if model.faults:
            model.duties_out.send((number,))

    monkeypatch.setattr(ThrustPairs, "output", output)
    silence = Strike("nack", "thrust_pairs", at_s=1.2, for_s=0.01)
    if is_sound:
        assert_sound("tachobot", [silence], for_s=1.5)
    else:
        with pytest.raises(AssertionError, match="not-finite"):
            assert_sound("tachobot", [silence], for_s=1.5)


def test_a_warning_of_a_healthy_robot_is_a_finding_unless_its_rig_says_that_it_is_right(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ak8963, "IDENTITY", 0x49)
    assert found_without_fault(0.5).startswith("invented of imu: reports Warning")
    healthy.cache_clear()
    space_of.cache_clear()
    monkeypatch.setattr(TachobotRig, "warned", ("imu",), raising=False)
    assert healthy(Mission(board="tachobot", for_s=0.5)).wrong is None


def test_a_device_that_is_used_less_often_after_a_fault_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("stuck", "body_sonar", at_s=5.0971375, for_s=0.0)
    assert_sound("detective", [silence], for_s=5.5)

    def fail(model: Sonar, error: HalError) -> None:
        model._rest = partial(model.hold_in, "resting", 5 * model.settings.period)  # type: ignore[method-assign]
        failed(model, error)

    failed = Sonar._fail
    monkeypatch.setattr(Sonar, "_fail", fail)
    healthy.cache_clear()
    with pytest.raises(AssertionError, match=r"slowed of body_sonar: body_sonar was used \d times"):
        assert_sound("detective", [silence], for_s=5.5)


def test_a_robot_that_goes_on_and_could_not_be_armed_again_is_not_healed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silence = Strike("nack", "imu", at_s=1.2, for_s=0.5)

    def kept(model: Imu, faults: int) -> None:
        model._consecutive_faults = faults or model._consecutive_faults
        model._has_worked = True

    monkeypatch.setattr(Imu, "consecutive_faults", property(lambda m: m._consecutive_faults, kept))
    with pytest.raises(AssertionError, match="it could not be armed: imu has failed"):
        assert_sound("tachobot", [silence], for_s=1.5)


def test_a_fault_that_cannot_be_made_is_refused_and_is_no_crash() -> None:
    with pytest.raises(ConfigError, match=r"frieze.*did you mean freeze"):
        assert_sound("tachobot", [Strike("frieze", "imu", at_s=0.2)], for_s=0.5)
    with pytest.raises(ConfigError, match="imo"):
        assert_sound("tachobot", [Strike("freeze", "imo", at_s=0.2)], for_s=0.5)


@pytest.mark.parametrize("for_s", [-1.0, 0.0, float("nan"), 1e9])
def test_a_mission_of_no_length_is_refused(for_s: float) -> None:
    with pytest.raises(ConfigError, match=r"--for: .+ expected a positive number of seconds"):
        assert_sound("tachobot", [], for_s=for_s)
