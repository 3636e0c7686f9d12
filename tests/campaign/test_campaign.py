"""Campaigns on TachoBot: the space, one run of it, planted mistakes, and how it resumes."""

import os
import sys
from collections.abc import Callable
from itertools import islice, pairwise
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest
from firmware_boards.detective.second_look import SecondLook
from firmware_drivers.chips.mpu9250 import Mpu9250
from msgspec.structs import replace

from firmware_runtime import HalError
from firmware_runtime.board.rig import Rig
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.strike import KINDS, OF_NO_DEVICE, Strike
from firmware_runtime.hal.wire_errors import Stuck
from firmware_runtime.lab.campaign import campaign, trial
from firmware_runtime.lab.campaign.again import assert_sound, rerun, rerun_many
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.campaigning import carry_out, report_of
from firmware_runtime.lab.campaign.courses import in_courses
from firmware_runtime.lab.campaign.evenly import spread
from firmware_runtime.lab.campaign.findings import findings_of, is_same
from firmware_runtime.lab.campaign.healthy import AT_START, healthy
from firmware_runtime.lab.campaign.kept_findings import rerun_findings
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.space import space_of
from firmware_runtime.lab.campaign.trial import Trial, alone, forked, trial_of
from firmware_runtime.lab.campaign.verdict import Verdict
from firmware_runtime.lab.campaign.watched import EVERY
from firmware_runtime.lab.sweeps.partial import partial_of
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.sweep_table import read_table
from firmware_runtime.recording.replay.replay_assertion import assert_replays
from firmware_runtime.runs.scripted_operator import ScriptedOperator
from firmware_runtime.system.signals import Signalled
from sim_doubles.rigs.tachobot import TachobotRig

SHORT = Mission(board="tachobot", for_s=1.5)
YAW = "tachobot.world.yaw_rad"
UNCHECKED = Mission(
    board="tachobot",
    for_s=1.5,
    assignments=("controller.compass_check.brief_tolerance_rad=10.0",),
)
"""Where the compass contradicts no gyro that soon."""


@pytest.fixture
def planted(
    monkeypatch: pytest.MonkeyPatch,
    anew: None,  # noqa: ARG001 -- no healthy run is kept, or used
) -> Callable[[Callable[..., Any]], None]:
    """Puts another `read_sample` into the IMU's driver."""

    def plant(read_sample: Callable[..., Any]) -> None:
        monkeypatch.setattr(Mpu9250, "read_sample", read_sample)

    return plant


def last_again() -> Callable[..., object]:
    """A driver that passes the last sample on where there is none."""
    read: Callable[..., object] = Mpu9250.read_sample
    kept: dict[int, object] = {}

    def read_sample(chip: Mpu9250, *asked: object) -> object:
        try:
            kept[id(chip)] = read(chip, *asked)
        except HalError:
            if id(chip) not in kept:
                raise
        return kept[id(chip)]

    return read_sample


def stuck_now_and_then() -> Callable[..., object]:
    """A driver that takes a living sensor for a dead one, at each fiftieth reading."""
    read: Callable[..., object] = Mpu9250.read_sample
    count = 0

    def read_sample(chip: Mpu9250, *asked: object) -> object:
        nonlocal count
        count += 1
        if count % 50 == 0:
            raise Stuck("imu", "rate", 0.0, 50)
        return read(chip, *asked)

    return read_sample


def never_disarms(_operator: ScriptedOperator, _at: int, _until: int) -> None:
    """Does nothing in its place."""


def never_arms_again(
    operator: ScriptedOperator,
    at: int,
    _until: int,
    whole: Callable[[ScriptedOperator, int, int], None] = ScriptedOperator.disarm,
) -> None:
    """Disarms for ever."""
    whole(operator, at, NEVER)


def numbers_of(
    kind: str, for_s: float | None, since_s: float = 1.2, device: str = "imu"
) -> list[int]:
    """Where in the space a kind strikes the IMU, or another device, once it is driven."""
    return [
        number
        for number, case in enumerate(space_of(SHORT))
        if (case.strikes[0].kind, case.strikes[0].device, case.strikes[0].for_s)
        == (kind, device, for_s)
        and case.strikes[0].at_s >= since_s
    ]


def test_a_sample_of_any_size_is_spread_over_the_space_and_has_nothing_twice() -> None:
    for size in (1, 2, 10, 997, 63_446):
        assert sorted(spread(size)) == list(range(size))
    for count in (10, 100, 1000):
        first = sorted(islice(spread(63_446), count))
        gaps = [later - sooner for sooner, later in pairwise(first)]
        assert max(gaps) < 4 * 63_446 / count


@pytest.mark.slow
def test_a_sample_has_each_kind_of_each_device_however_seldom_that_is_used() -> None:
    """A motor that is written twice a second has as many as a sensor that is read 100 times."""
    space = space_of(SHORT)
    order = list(in_courses(space))
    assert sorted(order) == list(range(space.singles))
    first = [space[number].strikes[0] for number in order[: 3 * len(space.faults)]]
    assert {(each.kind, each.device) for each in first} == set(space.faults)
    times = sorted(each.at_s for each in first)
    assert times[len(times) // 4] > 0.2 * SHORT.for_s
    assert times[3 * len(times) // 4] > 0.6 * SHORT.for_s


@pytest.mark.slow
def test_a_sample_has_four_times_as_many_bits_and_any_eight_in_a_row_are_of_one_byte() -> None:
    space = space_of(SHORT)
    faults = [space[number].strikes[0] for number in in_courses(space)]
    flips = [each for each in faults if (each.kind, each.device) == ("flip", "imu")]
    bits = [round(extent) % 8 for each in flips if (extent := each.extent) is not None]
    moments = list(dict.fromkeys(zip((each.at_s for each in flips), bits, strict=True)))
    for begin in range(len(moments) - 8):
        assert {bit for _, bit in moments[begin : begin + 8]} == {*range(8)}
    for kind, share in (("wrong-byte", 1.0), ("nack", 4.0)):
        sample = faults[: faults.index(flips[-1]) // 2]
        count = sum((each.kind, each.device) == (kind, "imu") for each in sample)
        assert sum(each in flips for each in sample) == pytest.approx(share * count, rel=0.1)


@pytest.mark.slow
def test_one_in_four_of_a_sample_strikes_before_outputs_are_first_on() -> None:
    space = space_of(replace(SHORT, for_s=4.0))
    sample = [space[number].strikes[0] for number in islice(in_courses(space), 600)]
    nacks = [each.at_s for each in sample if (each.kind, each.device) == ("nack", "imu")]
    moments = {(each.kind, each.device, each.at_s) for each in sample}
    at_s = [at_s for kind, _, at_s in moments if KINDS[kind].of not in OF_NO_DEVICE]
    on_at_s = space.found.on.index(True) * EVERY / SECOND
    early = sum(at < on_at_s for at in at_s) / len(at_s)
    assert 0.5 < on_at_s < 1.0
    assert min(nacks) < on_at_s
    assert early == pytest.approx(0.25 + 0.75 * on_at_s / 4.0, abs=0.08)


@pytest.mark.slow
def test_each_output_and_each_bit_has_its_turn_whatever_the_rhythm_of_uses() -> None:
    """Each second use is another device's: numbers of uses are all odd, or all even."""
    struck = [case.strikes[0] for case in space_of(SHORT)]
    outputs = {int(each.amount or 0) % 8 for each in struck if each.kind == "full-on"}
    assert outputs == set(range(8))
    bits = {int(each.amount or 0) % 8 for each in struck if each.kind == "flip"}
    assert bits == set(range(8))
    pushes = {each.amount for each in struck if each.kind == "push"}
    assert pushes == {None, -1.0, 1.0}  # it bears 1 once it is driven


@pytest.mark.slow
def test_each_fault_is_in_the_space_once_for_each_use_that_it_shows_in() -> None:
    found, space = healthy(SHORT), space_of(SHORT)
    assert len({case.strikes[0] for case in space}) == len(space)
    uses = [each.use for each in found.uses if each.use.address == 0x68]
    reads = {use.at for use in uses if use.reads}
    assert {case.before for case in space[:100]} == {AT_START}
    for kind, at in (("nack", {use.at for use in uses}), ("freeze", reads)):
        struck = [
            c.strikes[0] for c in space if (c.strikes[0].kind, c.strikes[0].device) == (kind, "imu")
        ]
        assert {each.at for each in struck} == at
        assert {each.for_s for each in struck} == {0.0, 1.0, None}
    assert all(
        KINDS[case.strikes[0].kind].of != "I2C" for case in space if case.strikes[0].device == ""
    )


@pytest.mark.slow
def test_a_fault_that_is_accepted_is_left_out() -> None:
    whole = set(space_of(SHORT).faults)
    fewer = Mission(board="tachobot", for_s=1.5, without=("push", "offset:imu", "stuck:i2c1"))
    assert whole - set(space_of(fewer).faults) == {
        *(("push", ""), ("offset", "imu"), ("stuck", "i2c1")),
    }


@pytest.mark.slow
def test_a_run_that_is_forked_is_to_the_bit_the_one_from_its_start() -> None:
    numbers = list(islice(in_courses(space_of(SHORT)), 8))
    numbers += [
        numbers_of(kind, for_s, device=device)[3]
        for for_s in (1.0, None)
        for kind, device in (("nack", "imu"), ("late", "imu"), ("absent", "imu"), ("stuck", "i2c1"))
    ]
    numbers += [numbers_of("weak", for_s, device="thrust_pairs")[3] for for_s in (1.0, None)]
    numbers += numbers_of("stall", None, device="")[:1]
    for kind, a_while in (("disarm", 3.0), ("hold", 1.0)):
        numbers += [numbers_of(kind, for_s, device="")[3] for for_s in (a_while, None)]
    numbers += numbers_of("reload", None, device="")[3:4]
    rows = list(forked(healthy(SHORT), numbers))
    assert sorted(int(row["row"] or 0) for row in rows) == sorted(numbers)
    for row in rows:
        assert rerun(row) == row


@pytest.mark.slow
def test_of_rows_that_are_run_again_those_that_differ_are_returned() -> None:
    rows = list(forked(healthy(SHORT), list(islice(in_courses(space_of(SHORT)), 6))))
    assert rerun_many(rows, 3, workers=1) == (3, [])
    changed = {**rows[2], "digest": "another"}
    assert rerun_many([*rows[:2], changed, *rows[3:]], 100, workers=1) == (6, [rows[2]])
    moved = {**rows[2], "at_s": 1.0}
    with pytest.raises(ConfigError, match="1 of 6 rows are other faults of tachobot by now"):
        rerun_many([*rows[:2], moved, *rows[3:]], 100, workers=1)
    (pair,) = forked(healthy(replace(SHORT, pairs=1)), [space_of(SHORT).singles])
    assert rerun_many([*rows, pair], 7, workers=1) == (7, [])


@pytest.mark.slow
def test_a_fault_that_is_over_before_outputs_are_given_up_is_not_the_one_for_ever() -> None:
    mission = Mission(board="detective", for_s=1.7)
    space = space_of(mission)
    last = range(len(space) - 500, len(space))
    numbers = [n for n in last if str(space[n].strikes[0]) == "arbitration of i2c1"][-2:]
    rows = list(forked(healthy(mission), numbers))
    assert len({row["digest"] for row in rows}) == 2
    for row in rows:
        assert rerun(row) == row


@pytest.mark.slow
def test_a_process_that_dies_for_one_fault_is_not_the_other_ones_verdict(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    numbers = [numbers_of("nack", for_s)[0] for for_s in (1.0, None)]
    rows = list(forked(healthy(SHORT), numbers))

    def dying(*_asked: object) -> object:
        os._exit(3)

    monkeypatch.setattr(trial, "_together", dying)
    assert list(forked(healthy(SHORT), numbers)) == rows


@pytest.mark.slow
def test_pairs_strike_within_a_second_and_are_shortened_to_one_where_one_will_do() -> None:
    paired = Mission(board="tachobot", for_s=1.5, pairs=50)
    space, single = space_of(paired), space_of(SHORT)
    assert (space.singles, len(space)) == (len(single), len(single) + 50)
    pairs = space[space.singles :]
    assert len({each.strikes for each in pairs}) == 50
    for first, second in (each.strikes for each in pairs):
        assert first != second
        assert 0 <= second.at - first.at <= SECOND
    order = list(in_courses(space, 100))
    assert len(order) == 150
    assert sum(number >= space.singles for number in order[:30]) == 10
    (row, *_) = forked(healthy(paired), [space.singles + 3])
    assert trial_of(row) == Trial(replace(paired, pairs=0), pairs[3].strikes)
    assert rerun(row) == row


@pytest.mark.slow
def test_a_pair_one_of_whose_faults_alone_shows_the_same_is_that_finding(
    planted: Callable[[Callable[..., Any]], None],
) -> None:
    planted(last_again())
    alone_at = Strike("nack", "imu", at_s=1.25, for_s=0.5)
    others = [Strike("slow", "i2c1", at_s=1.2, for_s=0.0), Strike("reload", at_s=1.2)]
    pairs = [
        alone(Trial(UNCHECKED, (each, alone_at)), number) for number, each in enumerate(others)
    ]
    (finding,) = findings_of(pairs, None)
    assert (finding.kind, finding.count, len(finding.faults)) == ("nack", 2, 1)
    (finding,) = findings_of([alone(Trial(UNCHECKED, (alone_at,)), 7), *pairs], None)
    assert (finding.kind, finding.count, finding.row) == ("nack", 3, 7)


@pytest.mark.slow
def test_a_sound_robot_has_no_finding_and_the_report_has_its_figures() -> None:
    report = campaign("tachobot", for_s=1.5, runs=24, workers=1)
    report.check()
    found = report.as_json()
    assert list(found)[-7:] == [
        *("runs", "space", "share", "silent", "crashes", "flakes", "findings"),
    ]
    assert (found["runs"], found["space"]) == (24, len(space_of(SHORT)))
    assert found["share"] == pytest.approx(24 / len(space_of(SHORT)))
    assert (found["silent"], found["crashes"], found["flakes"]) == (0, 0, 0)
    assert report.said
    assert "0 flakes" in str(report)


@pytest.mark.slow
def test_a_stale_value_that_is_passed_on_is_found_shortened_and_saved(
    planted: Callable[[Callable[..., Any]], None], tmp_path: Path
) -> None:
    planted(last_again())
    rows = list(forked(healthy(UNCHECKED), numbers_of("nack", None)[:2]))
    assert {row["outcome"] for row in rows} == {"stale"}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            "firmware_runtime.lab.campaign.campaigning.in_courses",
            lambda *_: iter(numbers_of("nack", None)[:2]),
        )
        shortened: list[tuple[int, int]] = []

        def stop(*_: int) -> None:
            raise KeyboardInterrupt

        table = tmp_path / "rows.csv"
        with pytest.raises(KeyboardInterrupt):
            carry_out(UNCHECKED, table, workers=1, shortening=stop)
        assert len(read_table(table, "campaign").rows) == 2
        report = carry_out(
            UNCHECKED,
            table,
            workers=1,
            findings=tmp_path,
            resume=True,
            progress=lambda *_: stop(),
            shortening=lambda number, count: shortened.append((number, count)),
        )
    assert shortened == [(1, 1)]
    (finding,) = report.findings
    assert (finding.model, finding.kind, finding.count) == ("imu", "nack", 2)
    assert finding.faults[0].for_s == 0.05
    assert len(finding.lines) == 3
    assert report.flakes == 0
    with pytest.raises(AssertionError, match=f"{finding.oracle} of imu"):
        report.check()
    assert finding.recording is not None
    assert_replays(finding.recording)
    assert finding.test is not None
    (test,) = [each for name, each in run_path(finding.test).items() if name.startswith("test_")]
    with pytest.raises(AssertionError, match=f"{finding.oracle} of imu"):
        test()


@pytest.mark.slow
def test_what_is_raised_in_a_struck_robot_is_a_crash_with_its_place(
    planted: Callable[[Callable[..., Any]], None],
) -> None:
    read: Callable[..., object] = Mpu9250.read_sample

    def read_sample(chip: Mpu9250, *asked: object) -> object:
        try:
            return read(chip, *asked)
        except HalError:
            return list(asked)[7]

    planted(read_sample)
    rows = forked(healthy(SHORT), numbers_of("nack", None)[:1])
    place = f"{Path(__file__).name}:{_line_of('list(asked)[7]')}"
    assert [(row["outcome"], row["model"]) for row in rows] == [("crash", place)]


def _line_of(text: str) -> int:
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    return next(number for number, line in enumerate(lines, 1) if f"return {text}" in line)


def check_wrong_by_itself(folder: Path, oracle: str, said: str) -> None:
    """Assert that a campaign's only finding is the robot without a fault, saved as a test."""
    report = campaign("tachobot", for_s=1.5, runs=5, workers=1, findings=folder)
    (finding,) = report.findings
    assert (finding.oracle, finding.faults, report.runs) == (oracle, (), 0)
    assert said in finding.what
    assert len(finding.lines) == 3
    test = run_path(str(finding.test))
    with pytest.raises(AssertionError, match=said):
        test[Path(str(finding.test)).stem]()
    assert [(again.kept.fixed, again.outcome) for again in rerun_findings(folder)] == [("", oracle)]


@pytest.mark.slow
def test_a_stretch_whose_time_is_over_opens_no_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = numbers_of("nack", None)[:2]
    rows = list(forked(healthy(SHORT), numbers, until=0.0, is_first=True))
    assert len(rows) >= 1
    monkeypatch.setattr(Mission, "opened", lambda *_: pytest.fail("it was opened"))
    assert list(forked(healthy(SHORT), numbers, until=0.0)) == []


@pytest.mark.slow
def test_a_fault_that_is_reported_without_any_is_a_finding_and_the_robot_is_not_struck(
    planted: Callable[[Callable[..., Any]], None], tmp_path: Path
) -> None:
    planted(stuck_now_and_then())
    check_wrong_by_itself(tmp_path, "invented", "reports Stuck")


@pytest.mark.slow
def test_what_a_rig_finds_wrong_without_any_fault_is_a_finding(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(TachobotRig, "judge", lambda _: "it flies")
    healthy.cache_clear()
    check_wrong_by_itself(tmp_path, "own", "it flies")
    monkeypatch.setattr(TachobotRig, "judge", lambda _: None)
    healthy.cache_clear()
    ((fixed, _, _),) = rerun_findings(tmp_path)
    assert fixed.fixed
    healthy.cache_clear()


@pytest.mark.slow
def test_what_the_oracle_of_a_test_has_found_is_kept_as_a_test_that_fails(tmp_path: Path) -> None:
    def judge(_: Rig) -> str:
        return "it is struck"

    report = campaign("tachobot", for_s=0.5, runs=1, findings=tmp_path, judge=judge)
    (finding,) = report.findings
    assert finding.needs_oracle
    assert (finding.faults, finding.what) == ((), "it is struck, and no fault was made")
    test = run_path(str(finding.test))
    with pytest.raises(ConfigError, match="put the oracle here"):
        test[Path(str(finding.test)).stem]()


@pytest.mark.slow
def test_an_output_is_named_by_its_number_however_large_the_one_is_that_was_counted_round() -> None:
    def judge(rig: Rig) -> str | None:
        assert isinstance(rig, TachobotRig)
        return "it turns" if abs(rig.world.state(rig.now())[4]) > 0.03 else None

    dead = Strike("dead", "thrust_pairs", at_s=1.0, amount=59302.0)
    trial = Trial(SHORT, (dead,))
    row = alone(trial, 3, judge)
    (finding,) = findings_of([row], None, judge)
    (strike,) = finding.faults
    assert strike.amount == 1.0
    again = Trial(SHORT, (replace(strike, amount=59302.0),))
    assert is_same(alone(finding.trial, oracle=judge), alone(again, oracle=judge))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("judge", "fault"),
    [
        (lambda _: 1 / 0, r"judge: ZeroDivisionError: division by zero \(test_campaign.py:\d+\)"),
        (lambda _: True, "judge: True; expected a sentence or None"),
        (3, "judge: 3; expected a function of a rig"),
    ],
)
def test_an_oracle_that_is_none_is_refused_before_anything_is_struck(
    judge: Oracle, fault: str
) -> None:
    with pytest.raises(ConfigError, match=fault):
        campaign("tachobot", for_s=0.5, runs=1, judge=judge)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "is_property"),
    [
        *(("truth", False), ("judge", False), ("lost", False), ("push", False), ("hold", False)),
        *(("outputs", True), ("is_driven", True)),
    ],
)
@pytest.mark.parametrize(
    "raised", [ValueError("out of tune"), AttributeError("out of tune"), SystemExit("out of tune")]
)
def test_a_rig_that_raises_is_refused_by_its_part(
    monkeypatch: pytest.MonkeyPatch, part: str, raised: BaseException, *, is_property: bool
) -> None:
    def broken(*_: object, **__: object) -> object:
        raise raised

    put = property(broken) if is_property else broken
    monkeypatch.setattr(TachobotRig, part, put, raising=False)
    healthy.cache_clear()
    with pytest.raises(ConfigError, match=f"rig tachobot .*: {part}: .*out of tune"):
        campaign("tachobot", for_s=0.1, runs=1, workers=1)


@pytest.mark.slow
def test_a_world_that_raises_is_said_with_its_place_and_not_what_comes_of_it_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sound = TachobotRig.catch_up

    def catch_up(rig: TachobotRig) -> None:
        if rig.now() > SECOND // 5:
            raise ValueError("out of tune")
        sound(rig)

    monkeypatch.setattr(TachobotRig, "catch_up", catch_up)
    healthy.cache_clear()
    with pytest.raises(ConfigError, match=r"rig tachobot .*out of tune \(.*\.py, line \d+\)"):
        campaign("tachobot", for_s=0.3, runs=1, workers=1)


@pytest.mark.slow
@pytest.mark.parametrize("part", ["truth", "attach"])
def test_a_signal_is_no_fault_of_a_rig(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    def signalled(*_: object) -> object:
        raise Signalled(143)

    monkeypatch.setattr(TachobotRig, part, signalled)
    healthy.cache_clear()
    with pytest.raises(Signalled):
        campaign("tachobot", for_s=0.1, runs=1, workers=1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([{"a": 1.0}, {"a": 1.0, "b": 2.0}], "a, b; expected as at first, a"),
        ([{"a": 1.0}, {}], "expected as at first, a"),
        ([{"a": 1.0}, {"a": float("nan")}], "a is nan; expected a finite number"),
        ([{"a": 1.0}, {"a": None}], "a is None; expected a number, or some"),
        ([["a"]], "expected values by their names"),
    ],
    ids=str,
)
def test_a_truth_that_is_not_the_same_numbers_at_each_look_is_refused(
    monkeypatch: pytest.MonkeyPatch, values: list[object], said: str
) -> None:
    def truth(rig: TachobotRig) -> object:
        return values[0] if rig.now() < SECOND // 20 else values[-1]

    monkeypatch.setattr(TachobotRig, "truth", truth)
    monkeypatch.setattr(TachobotRig, "borne", {})
    healthy.cache_clear()
    with pytest.raises(ConfigError, match=f"truth: .*{said}"):
        campaign("tachobot", for_s=0.1, runs=1, workers=1)


@pytest.mark.slow
def test_a_model_that_quits_is_refused_and_ends_no_campaign(
    planted: Callable[[Callable[..., Any]], None],
) -> None:
    planted(lambda *_: sys.exit(0))
    with pytest.raises(ConfigError, match=r"fails without any fault: .* raised SystemExit\(0\)"):
        campaign("tachobot", for_s=0.1, runs=1, workers=1)


@pytest.mark.slow
def test_a_campaign_judges_one_fault_however_short_its_budget() -> None:
    report = campaign("tachobot", for_s=0.1, budget_s=1e-9, workers=1)
    assert 0 < report.runs < 4


@pytest.mark.slow
def test_a_robot_is_judged_by_a_line_of_ones_own_too() -> None:
    (case, *_) = space_of(SHORT)[numbers_of("nack", 0.0)[0] :]
    assert_sound("tachobot", [case.strikes[0]], for_s=1.5, judge=lambda _: None)
    with pytest.raises(AssertionError, match="own of imu: it is struck"):
        assert_sound("tachobot", [case.strikes[0]], for_s=1.5, judge=lambda _: "it is struck")
    assert_sound("tachobot", [], for_s=1.5)
    twice = replace(case.strikes[0], at_s=1.4)
    assert_sound("tachobot", [case.strikes[0], twice], for_s=1.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "strike",
    [
        pytest.param(Strike("full-on", "thrust_pairs", at_s=0.0), id="said once there are sensors"),
        pytest.param(
            Strike("full-on", "thrust_pairs", at_s=0.0479925, for_s=1.0, amount=16.0),
            id="off since it spins, and says so",
        ),
        pytest.param(Strike("stuck", "i2c1", at_s=0.79, for_s=1.0), id="after the first sample"),
    ],
)
def test_tachobot_bears_what_strikes_before_or_as_control_begins(strike: Strike) -> None:
    assert_sound("tachobot", [strike], for_s=1.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mistake", "for_s", "finding"),
    [
        (never_disarms, None, "on of world: it was disarmed 0.3 s ago, and an output is on"),
        (never_arms_again, 1.0, "unhealed of world: 5 s after the fault outputs are off"),
    ],
)
def test_a_robot_that_is_not_disarmed_or_armed_again_is_found(
    monkeypatch: pytest.MonkeyPatch,
    mistake: Callable[[ScriptedOperator, int, int], None],
    for_s: float | None,
    finding: str,
) -> None:
    strike = Strike("disarm", at_s=1.2, for_s=for_s)
    assert_sound("tachobot", [strike], for_s=1.5)
    monkeypatch.setattr(ScriptedOperator, "disarm", mistake)
    with pytest.raises(AssertionError, match=finding):
        assert_sound("tachobot", [strike], for_s=1.5)


@pytest.mark.slow
def test_a_rig_has_an_oracle_and_a_limit_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TachobotRig, "judge", lambda _: "it is watched")
    monkeypatch.setattr(TachobotRig, "said_within_s", 1.25, raising=False)
    mission = Mission(board="tachobot", for_s=0.5)
    assert healthy(mission).within == 1.25 * SECOND
    (row,) = forked(healthy(mission), [len(space_of(mission)) - 1])
    assert (row["outcome"], row["what"]) == ("own", "it is watched")
    healthy.cache_clear()


@pytest.mark.slow
def test_a_rig_says_what_is_no_harm_and_what_nothing_can_tell(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mission = Mission(board="tachobot", for_s=0.5)
    usual, faults = healthy(mission).envelope, space_of(mission).faults
    place = usual.names.index(YAW)
    healthy.cache_clear()
    space_of.cache_clear()
    monkeypatch.setattr(TachobotRig, "borne", {YAW: 2.0}, raising=False)
    monkeypatch.setattr(TachobotRig, "unknowable", ("offset:imu", "push"), raising=False)
    found = healthy(mission)
    assert found.envelope.high[-1][place] - usual.high[-1][place] > 1.5
    assert found.envelope.high[-1][place + 1] == usual.high[-1][place + 1]
    left_out = {*faults} - {*space_of(mission).faults}
    assert left_out == {("offset", "imu"), ("push", "")}
    report = carry_out(mission, runs=4, workers=1)
    assert "left out: offset:imu, push" in str(report)
    assert report.as_json()["left_out"] == ["offset:imu", "push"]
    assert "its rig answers truth, " in str(report)
    assert f", borne = {{{YAW}: 2.0}}" in str(report)
    assert report.limits["borne"] == {YAW: 2.0}
    assert report.as_json()["rig"] == {"answers": report.answers, "states": report.limits}
    healthy.cache_clear()
    space_of.cache_clear()


def refused(monkeypatch: pytest.MonkeyPatch, attribute: str, value: object, fault: str) -> str:
    """Return how a mission is refused whose rig says this."""
    healthy.cache_clear()
    monkeypatch.setattr(TachobotRig, attribute, value, raising=False)
    with pytest.raises(ConfigError, match=fault) as caught:
        healthy(Mission(board="tachobot", for_s=0.5))
    healthy.cache_clear()
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("attribute", "value", "fault"),
    [
        ("borne", {"tachobot.world.yaw": 1.0}, "did you mean tachobot.world.yaw_rad"),
        ("unknowable", ("frieze:imu",), "did you mean freeze"),
        ("off_within_s", {"imo": 0.1}, "did you mean imu"),
        ("ends_within_s", {"imo": 0.1}, "did you mean imu"),
        ("unknowable", ("freeze:imo",), "freeze:imo: did you mean imu"),
        ("unpaced", ("i2c2",), "did you mean i2c1"),
        ("bears_reading_of", ("imo",), "did you mean imu"),
        ("warned", ("imo",), "did you mean imu"),
        ("off_within_s", {"controller.heading_chek": 0.1}, "did you mean controller.heading_check"),
    ],
)
def test_what_a_rig_says_of_no_number_kind_or_device_is_refused(
    monkeypatch: pytest.MonkeyPatch, attribute: str, value: object, fault: str
) -> None:
    said = refused(monkeypatch, attribute, value, fault)
    assert f"tachobot: {attribute} of its rig" in said


def _raise(_rig: object, *_asked: object) -> None:
    raise KeyError("x")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("attribute", "value", "fault"),
    [
        ("said_within_s", 800, "said_within_s: 800: expected float <= 60"),
        ("held_within_s", 0, "held_within_s: 0: expected float > 0"),
        ("said_witin_s", 0.8, "said_witin_s: did you mean said_within_s"),
        ("losst", lambda _rig: None, "losst: did you mean lost"),
        ("borne", {YAW: -1.0}, "borne: .*expected float >= 0"),
        ("is_driven", lambda _rig: True, "is_driven: .*expected True or False"),
        ("truth", lambda _rig: None, r"truth\(\) None; expected values by their names"),
        ("truth", property(lambda _rig: {"a": 1.0}), "truth {'a': 1.0}; expected a method"),
        ("recovered_within_s", 0, "recovered_within_s: 0: expected float > 0"),
        ("restore", 3, "restore 3; expected a method"),
        ("missed", lambda _rig: 3, r"missed\(\) 3; expected a sentence or None"),
        ("levels", _raise, "levels: KeyError: 'x'"),
        ("outputs", {"lift": None}, "outputs: lift None; expected how many of its outputs are on"),
    ],
)
def test_what_a_rig_cannot_say_is_refused_before_anything_is_struck(
    monkeypatch: pytest.MonkeyPatch, attribute: str, value: object, fault: str
) -> None:
    assert "rig" in refused(monkeypatch, attribute, value, fault)


@pytest.mark.slow
def test_a_rig_without_numbers_of_its_world_has_two_oracles_less_and_the_report_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    healthy.cache_clear()
    space_of.cache_clear()

    def truth(rig: TachobotRig) -> dict[str, object]:
        rig.catch_up()
        return {}

    monkeypatch.setattr(TachobotRig, "truth", truth)
    monkeypatch.setattr(TachobotRig, "borne", {"tachobot.world.x.0": 0.05})
    with pytest.raises(ConfigError, match=r"borne of its rig.*\n.*there are no numbers in truth"):
        carry_out(Mission(board="tachobot", for_s=0.3), runs=2, workers=1)
    monkeypatch.setattr(TachobotRig, "borne", {})
    report = carry_out(Mission(board="tachobot", for_s=0.3), runs=2, workers=1)
    assert report.as_json()["not_judged"] == ["silent", "astray"]
    assert "not judged: silent, astray: its rig has no truth() with numbers" in str(report)
    healthy.cache_clear()
    space_of.cache_clear()


@pytest.mark.slow
def test_a_campaign_that_is_interrupted_goes_on_to_the_same_table(tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole.csv", tmp_path / "broken.csv"
    carry_out(SHORT, whole, runs=20, workers=1)

    def stop(done: int, _size: int, _found: int) -> None:
        if done == 18:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        carry_out(SHORT, broken, runs=20, workers=1, progress=stop)
    assert partial_of(broken).exists()
    with pytest.raises(ConfigError, match="expected --resume"):
        carry_out(SHORT, broken, runs=20, workers=1)
    other = Mission(board="tachobot", for_s=2.0)
    with pytest.raises(ConfigError, match=r"campaign tachobot --for 1\.5 with version"):
        carry_out(other, broken, runs=20, workers=1, resume=True)
    done: list[int] = []
    report = carry_out(
        SHORT, broken, runs=20, workers=1, resume=True, progress=lambda n, *_: done.append(n)
    )
    assert done == [19, 20]
    assert report.runs == 20
    assert broken.read_bytes() == whole.read_bytes()
    assert not partial_of(broken).exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"for_s": 0.0}, "--for"),
        ({"runs": 0}, "--runs"),
        ({"without": ["frieze:imu"]}, "did you mean freeze"),
        ({"budget_s": -1.0}, "--budget"),
        ({"within_s": float("nan")}, "--within"),
        ({"workers": 0}, "--workers"),
        ({"workers": 1, "scheduler": "tcp://x:1"}, "expected one"),
        ({"resume": True}, "--resume"),
        ({"output": "table.txt"}, "expected a name that ends in"),
        ({"set": {"controller.yaw.kq": 1.0}}, "kq"),
    ],
    ids=str,
)
def test_what_cannot_be_is_refused_before_any_run(words: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        campaign("tachobot", **words)


@pytest.mark.slow
def test_a_robot_that_has_gone_on_by_itself_is_watched_until_that_shows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    echo = Strike("wrong-byte", "radar_sonar", at_s=1.827145, for_s=0.0, amount=3.0)
    trial = Trial(Mission(board="detective", for_s=6.0), (echo,))
    assert alone(trial)["outcome"] == "sound"
    monkeypatch.setattr(SecondLook, "external", SecondLook.continue_)
    row = alone(trial)
    assert row["outcome"] == "silent"
    assert "world.heading_rad" in str(row["what"])
    assert float(str(row["known_at_s"])) > 2.8  # it is where healthy ones are for a second


@pytest.mark.slow
@pytest.mark.parametrize(
    ("without", "said"),
    [("freeze:imo", "did you mean imu"), ("push:", "expected one of imu")],
)
def test_a_fault_that_is_left_out_is_one_of_the_robot(without: str, said: str) -> None:
    with pytest.raises(ConfigError, match=f"--without {without}: {said}"):
        campaign("tachobot", for_s=0.5, without=[without])


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("found", None, "cannot be written"),
        ("found/findings.json", b"{", "expected what"),
        ("found/findings.json", b'[{"finding": {"oracle": "\xe3("}}]', "expected what"),
    ],
)
def test_a_folder_that_can_keep_no_findings_is_refused_before_any_run(
    tmp_path: Path, name: str, content: bytes | None, said: str
) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content or b"")
    with pytest.raises(ConfigError, match=rf"--findings: .*{said}"):
        campaign("tachobot", findings=tmp_path / "found", progress=lambda *_: pytest.fail("a run"))


def test_a_board_without_a_seed_refuses_one() -> None:
    with pytest.raises(ConfigError, match=r"pan_tilt has no world\.seed"):
        campaign("pan_tilt", seed=3)


def test_a_row_of_another_table_is_refused() -> None:
    row: Row = {"row": 3, "board": "tachobot", "outcome": "ended", "set": "[]"}
    with pytest.raises(ConfigError, match="row 3 is none of a campaign"):
        rerun(row)


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("what", ...),
        ("known_at_s", "soon"),
        ("reached", "[[1]]"),
        ("row", "x"),
        ("at_s", 10**400),
        ("mission_s", 1e9),
    ],
)
def test_a_row_that_is_damaged_is_refused_and_named(column: str, cell: object) -> None:
    trial = Trial(Mission(board="tachobot"), (Strike("nack", "imu", at_s=1.0),))
    sound, damaged = (dict(trial.row(number, Verdict(outcome="late"))) for number in (0, 1))
    damaged[column] = cell  # type: ignore[assignment]
    if cell is ...:
        del damaged[column]
    with pytest.raises(ConfigError, match=r"row .+ is none of a campaign"):
        report_of([sound, damaged])


def test_an_instant_of_the_space_comes_back_from_its_row_exactly() -> None:
    assert all(
        round(at / SECOND * SECOND) == at for at in (1, 590_592, 9_999_999_999, 59_123_456_789)
    )


def test_a_folder_of_findings_that_cannot_be_made_is_refused_before_any_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delattr("firmware_runtime.lab.campaign.campaigning.space_of")
    with pytest.raises(ConfigError, match="--findings"):  # root may write to /proc, and cannot
        campaign("tachobot", for_s=1.0, runs=1, findings="/proc/found")


@pytest.mark.slow
def test_one_that_is_disarmed_again_and_again_may_be_armed_in_between() -> None:
    disarmed = Strike("disarm", at_s=1.0, for_s=0.5)
    assert_sound("tachobot", [*disarmed.again(3, every_s=1.0)], for_s=4.0)
