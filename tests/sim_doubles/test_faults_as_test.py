"""Faults of served doubles, written as a test: the script, what it asserts, and that it runs."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from firmware_runtime import ConfigError, Strike, open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.served.client import ServedDoubles
from firmware_runtime.hal.served.packets import FaultList, ListFaults
from firmware_runtime.hal.served.strikes import ask_faults
from firmware_runtime.runs.fault_test import FaultTest, quoted, source_of, sources_of
from firmware_runtime.runs.open_board import OpenBoard
from sim_doubles.commands.faults_as_test import Script, script_of, text_of_test, what_is_noticed
from sim_doubles.testing.broken import assert_ends_off, assert_noticed, noticed
from tests.support.second_choice_board import second_choice_board
from tests.support.served_rig import ServedRig, served_rig

ADDRESS = 0x40
"""A PCA9685 that each of these robots has."""


def listing_after(board: str, *strikes: Strike, assignments: tuple[str, ...] = ()) -> FaultList:
    """What a server has kept of faults a second and more after a run began on its doubles."""
    with served_rig(board, *assignments) as rig:
        rig.clock.advance(5 * SECOND)
        begin(rig)
        rig.clock.advance(2300 * MILLISECOND)
        for each in strikes:
            ask_faults(rig.ask, each)
            rig.clock.advance(SECOND)
        return ask_faults(rig.ask, ListFaults())


def begin(rig: ServedRig) -> None:
    bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
    bus.transaction(ADDRESS, (b"\xfe", 1))


def written(listing: FaultList, name: str = "that_day") -> tuple[str, str | None]:
    script = script_of(listing)
    noticed = what_is_noticed(script)
    return text_of_test(script, name, noticed), noticed


def called(text: str, name: str = "test_that_day") -> None:
    """Run a test as pytest does."""
    names: dict[str, Callable[[], None]] = {}
    exec(compile(text, "test_that_day.py", "exec"), names)  # noqa: S102 -- what was written is tried
    names[name]()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "device"), [("tachobot", "imu"), ("detective", "body_compass"), ("pan_tilt", "eyes")]
)
def test_it_runs_as_it_is_written_and_asserts_that_the_robot_notices(
    board: str, device: str
) -> None:
    text, noticed = written(listing_after(board, Strike("nack", device, for_s=0.5)))
    assert f'Strike("nack", "{device}", at_s=2.3, for_s=0.5)' in text
    assert noticed is not None
    assert device in noticed
    assert "assert_noticed(robot)" in text
    called(text)
    with pytest.raises(AssertionError, match=r"no fault was reported after push"):
        called(text.replace(f'"nack", "{device}"', '"push"').replace(", for_s=0.5", ""))


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective", "pan_tilt"])
def test_what_is_not_noticed_is_no_assertion_and_the_end_is_off(board: str) -> None:
    text, noticed = written(listing_after(board, Strike("push", amount=0.25)))
    assert noticed is None
    assert 'Strike("push", at_s=2.3, amount=0.25)' in text
    assert "assert_noticed" not in text
    assert "assert_ends_off(robot)" in text
    called(text)


@pytest.mark.slow
def test_an_output_that_cannot_be_reached_at_the_end_is_what_the_test_expects() -> None:
    text, noticed = written(listing_after("detective", Strike("nack", "treads")))
    assert noticed is not None
    assert noticed.startswith("not made safe")
    assert "pytest.raises(HalError" in text
    called(text)


@pytest.mark.slow
def test_numbers_that_were_overridden_are_in_it() -> None:
    set_words = ("controller.yaw.kp=0.5", 'imu.mounting="+y -x +z"')
    listing = listing_after("tachobot", Strike("zero", "imu", for_s=0.5), assignments=set_words)
    text, _ = written(listing)
    assert "set={'controller.yaw.kp': 0.5, 'imu.mounting': '+y -x +z'}" in text
    called(text)


@pytest.mark.slow
def test_a_robot_of_ones_own_file_is_opened_by_its_path(tmp_path: Path) -> None:
    board = second_choice_board(tmp_path)
    text, noticed = written(listing_after(str(board), Strike("silent", "body_sonar", for_s=2.0)))
    assert str(board) in text
    assert noticed is not None
    called(text)


@pytest.fixture
def tachobot() -> Iterator[OpenBoard]:
    with open_board("tachobot", doubles=True, clock="virtual") as robot:
        yield robot


def test_a_robot_notices_where_it_reports_a_fault_or_has_all_outputs_off(
    tachobot: OpenBoard,
) -> None:
    assert noticed(tachobot) == "all outputs are off"
    tachobot.run(0.9)
    tachobot.strike("push", amount=0.1)
    tachobot.run(0.05)
    assert noticed(tachobot) is None
    with pytest.raises(AssertionError, match=r"push of all, and outputs are on: .*pairs': 8"):
        assert_noticed(tachobot)
    tachobot.strike("nack", "imu")
    tachobot.run(0.03)
    assert noticed(tachobot) == "imu: NoAcknowledge"
    tachobot.run(0.2)
    said = str(noticed(tachobot)).split(", ")
    assert said == ["thrust_pairs: NotReady", "imu: NoAcknowledge", "all outputs are off"]
    assert_noticed(tachobot)
    assert_ends_off(tachobot)


def test_instants_are_those_of_the_run_and_what_was_before_it_is_left_out() -> None:
    with served_rig("tachobot") as rig:
        ask_faults(rig.ask, Strike("nack", "imu", for_s=1.0))
        rig.clock.advance(SECOND // 2)
        ask_faults(rig.ask, Strike("absent", "thrust_pairs"))
        rig.clock.advance(SECOND)
        begin_refused(rig)
        rig.clock.advance(SECOND)
        ask_faults(rig.ask, Strike("nack", "imu", for_s=0))
        ask_faults(rig.ask, Strike("brown-out", "imu"))
        script = script_of(ask_faults(rig.ask, ListFaults()))
    assert script.faults == [
        Strike("absent", "thrust_pairs", 0.0),
        Strike("nack", "imu", 1.0, 0.0),
        Strike("brown-out", "imu", 1.0),
    ]
    assert script.for_s == 4.0
    assert source_of(script.faults[1]) == 'Strike("nack", "imu", at_s=1.0, for_s=0.0)'


def test_a_fault_that_comes_again_and_again_is_one_line_of_a_script() -> None:
    nack, push = Strike("nack", "imu", at_s=0.7, for_s=0.0), Strike("push", at_s=1.0)
    again = nack.again(3, every_s=1.1)
    assert [each.at_s for each in again] == pytest.approx([0.7, 1.8, 2.9])
    (script,) = sources_of(again)
    assert script == f"*{source_of(nack)}.again(3, every_s=1.1)"
    assert eval(f"[{script}]", {"Strike": Strike}) == [*again]  # noqa: S307 -- what was written
    for others in ([], [nack], [nack, push], [*again, push], [nack, nack, nack.again(2, 1.0)[1]]):
        assert sources_of(others) == [source_of(each) for each in others]


@pytest.mark.parametrize(
    ("faults", "written"),
    [
        ((), "FAULTS: list[Strike] = []\n"),
        ((Strike("push"),), 'FAULTS = [\n    Strike("push", at_s=0.0),\n]\n'),
    ],
)
def test_a_script_may_have_no_fault(faults: tuple[Strike, ...], written: str) -> None:
    test = FaultTest(
        name="that_day", title="T", about="A", imported="", faults=faults, body=["pass"]
    )
    assert written in test.text()


def test_a_name_with_quotes_is_a_text_of_python() -> None:
    assert eval(quoted(name := """an "eye" isn't \\""")) == name  # noqa: S307 -- what was written


def begin_refused(rig: ServedRig) -> None:
    bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
    with pytest.raises(Exception, match="not acknowledged"):
        bus.transaction(ADDRESS, (b"\xfe", 1))


def test_an_end_that_is_not_safe_is_noticed() -> None:
    out_of_reach = Strike("nack", "treads", at_s=0.02)
    found = what_is_noticed(Script("detective", {}, [out_of_reach], for_s=1.0))
    assert str(found).startswith("not made safe: i2c1 0x58")


def test_without_a_run_or_a_fault_there_is_no_test() -> None:
    with served_rig("tachobot") as rig:
        ask_faults(rig.ask, Strike("nack", "imu"))
        with pytest.raises(ConfigError, match="no robot was run"):
            script_of(ask_faults(rig.ask, ListFaults()))
    with pytest.raises(ConfigError, match="nothing was broken"):
        script_of(listing_after("tachobot"))
