"""A debugger of recorded runs: to any instant, by event, backwards, to a predicate, into pdb."""

import io
import json
from collections.abc import Callable
from decimal import Decimal
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
from firmware_drivers.thrust_pairs import Forces

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.models.motion import Applied
from firmware_runtime.recording.debugger.commands import Commands
from firmware_runtime.recording.debugger.debugger import Debugger
from firmware_runtime.recording.debugger.model_state import Models
from firmware_runtime.recording.debugger.predicate import Predicate, Seen, may_have
from firmware_runtime.recording.debugger.travel import Travel
from tests.support.allocation import sends
from tests.support.command import Command, Ended
from tests.support.recorded import record
from tests.support.replayed import opened

Debug = Callable[..., list[Any]]
Prompt = Callable[..., Ended]
YAW = "controller.yaw"


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds of a platform that turns, with a keyframe at 5 s."""
    return record(tmp_path_factory.mktemp("flight") / "flight.recording", "tachobot", 8)


@pytest.fixture
def travel(flight: Path) -> Travel:
    """In that recording."""
    return Travel(*opened(flight), None)


@pytest.fixture
def prompt(flight: Path, monkeypatch: pytest.MonkeyPatch, command: Command) -> Prompt:
    """Give commands, from second 6 on or where these words say."""

    def prompted(*lines: str, words: tuple[str, ...] = ("--at", "6")) -> Ended:
        monkeypatch.setattr("sys.stdin", io.StringIO("\n".join(lines)))
        return command("debug", flight, *words)

    return prompted


@pytest.fixture
def debug(prompt: Prompt) -> Debug:
    """Give commands; returns the answers, from JSON."""

    def debugged(*lines: str, words: tuple[str, ...] = ("--at", "6"), status: int = 0) -> list[Any]:
        ended = prompt(*lines, words=("--json", *words))
        assert ended.status == status
        return [json.loads(line) for line in ended.out.splitlines()]

    return debugged


@pytest.mark.slow
def test_a_state_that_cannot_be_kept_is_reached_and_left_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def kept(model: Any, force: float) -> float:  # noqa: ANN401
        model.last = Decimal(force)  # made during the run, and no part of a keyframe
        return force

    sends(monkeypatch, kept)
    path = record(tmp_path / "decimal.recording", "tachobot", 4)
    travel = Travel(*opened(path), None)
    for at in (3 * SECOND, 2 * SECOND, 4 * SECOND):
        travel.go_to(travel.index_after(at))
        assert (travel.at, travel.player.first) == (at, None)


@pytest.mark.slow
def test_the_state_at_an_instant_is_the_same_by_every_way_there(travel: Travel) -> None:
    assert travel.player.table is not None
    place = travel.index_after(6 * SECOND)
    travel.go_to(place)
    from_keyframe, at = travel.player.table.capture(), travel.at
    assert at == 6 * SECOND
    travel.go_to(travel.length)
    travel.go_to(place)
    assert (travel.player.table.capture(), travel.at) == (from_keyframe, at)
    travel.go_to(1)
    assert travel.at == 0
    while travel.index < place:
        travel.take()
    assert travel.player.table is not None
    assert list(travel.player.table.differences(from_keyframe)) == []
    assert travel.player.first is None


def test_at_a_keyframe_the_last_value_of_each_port_is_there_however_long_ago_it_left(
    travel: Travel,
) -> None:
    travel.go_to(travel.index_after(5 * SECOND))
    assert travel.last["thrust_pairs.applied"] is Applied.ALL
    assert {"imu.sample", "controller.yaw.command_n"} <= travel.last.keys()


def test_events_go_forwards_and_backwards(debug: Debug) -> None:
    begin, first, second, third, back, start, earlier = debug(
        "next", "n", "next 1", "back", "rn 2", "back"
    )
    assert (begin["t_s"], begin["event"]) == (6, 0)
    assert [each["event"] for each in (first, second, third)] == [1, 2, 3]
    assert (first["model"], first["function"]) == ("imu", "output")
    assert first["t_ns"] > begin["t_ns"]
    assert first["date"] > begin["date"] > "2026"
    assert {**back, "reason": ""} == {**second, "reason": ""}
    assert (start["t_ns"], start["event"]) == (begin["t_ns"], 0)
    assert earlier["t_ns"] == start["t_ns"]
    assert earlier["event"] > 3  # the last but one of the instant before


def test_instants_go_forwards_and_backwards(debug: Debug) -> None:
    states = debug("step", "step 2", "rstep", "rs 2", "goto 0.5", "goto 6", "p controller.yaw")
    times = [each["t_ns"] / SECOND for each in states]
    assert times == [6, 6.01, 6.03, 6.02, 6, 0.5, 6, 6]
    [_, again] = debug("print controller.yaw")
    assert states[-1]["state"] == again["state"]
    assert again["state"]["phase"] == "waiting"


def test_an_instant_that_is_under_way_is_the_first_that_is_gone_back(debug: Debug) -> None:
    states = debug("next", "rstep", "next", "rstep 2", "next", "rstep 3")
    places = [(each["t_ns"] / SECOND, each["event"]) for each in states]
    assert places == [(6, 0), (6.01, 1), (6, 0), (6.01, 1), (5.99, 0), (6, 1), (5.97, 0)]


def test_back_at_the_start_it_shows_the_robot_as_it_was_there(debug: Debug) -> None:
    commands = (f"p {YAW}", "step 30", f"p {YAW}", "rstep 100", f"p {YAW}")
    start, begin, _, later, back, again = debug(*commands, words=())
    assert (back["t_ns"], back["event"]) == (start["t_ns"], 0)
    assert later["state"] != begin["state"] == again["state"]


def test_it_stops_where_a_predicate_begins_to_hold_and_the_value_is_there(debug: Debug) -> None:
    commands = ("until controller.yaw.command_n > 0.5", f"print {YAW}.command_n", f"ports {YAW}")
    [_, there, value, ports] = debug(*commands, words=())
    assert ports == {"path": YAW, "ports": {"command_n": value["value"]}}
    assert there["model"] == YAW
    assert there["function"] == "output"
    assert value["value"] > 0.5
    [begin, before] = debug("goto 0.5", words=())
    assert (begin["event"], begin["reason"]) == (0, "between two instants")
    assert before["t_s"] == 0.5


def test_what_a_port_sent_last_is_printed_and_else_an_attribute(debug: Debug) -> None:
    _, sample, ports, reference = debug("p imu.sample", "ports imu", f"p {YAW}.reference")
    assert sample["value"] == ports["ports"]["sample"] is not None
    assert reference["value"] == 1.0


def test_breakpoints_of_functions_and_predicates(debug: Debug) -> None:
    answers = debug("b imu.sample", "c", "break controller.yaw.internal", "delete 1", "d")
    assert answers[2]["reason"] == "breakpoint 1: imu.sample, after imu output"
    listed = [each["breakpoints"] for each in (answers[1], *answers[3:])]
    assert listed == [
        {"1": "imu.sample"},
        {"1": "imu.sample", "2": "controller.yaw.internal"},
        {"2": "controller.yaw.internal"},
        {},
    ]
    answers = debug("break controller.yaw.internal", "continue", "next")
    assert answers[2]["reason"] == f"breakpoint 1, before {YAW} internal"
    assert (answers[3]["model"], answers[3]["function"]) == (YAW, "internal")


def test_behind_an_event_that_was_gone_back_to_breakpoints_are_stopped_at(debug: Debug) -> None:
    function = f"{YAW}.internal"
    *_, back, there = debug(f"b {function}", "next 2", "back", "c")
    assert (back["event"], there["reason"]) == (1, f"breakpoint 1, before {YAW} internal")


def test_a_breakpoint_of_values_stops_only_where_they_begin_to_be_so(debug: Debug) -> None:
    text = f"{YAW}.command_n > 0.5"
    [_, _, first, then] = debug(f"b {text}", "c", "step 5", words=())
    assert first["reason"] == f"breakpoint 1: {text}, after {YAW} output"
    assert (then["t_ns"] > first["t_ns"], then["reason"]) == (True, "between two instants")


def test_pdb_stops_inside_the_models_function(prompt: Prompt) -> None:
    lines = ["pdb controller.yaw.external", "p self.name", "p elapsed", "q", "where"]
    status, printed, _ = prompt(*lines)
    assert status == 0
    assert "def external(self, elapsed: int)" in printed
    assert "(Pdb) 'yaw'" in printed
    assert printed.count("between two instants") == 1  # quit leaves both


def test_from_pdb_continue_goes_back_to_the_recording_behind_the_call(
    prompt: Prompt,
) -> None:
    lines = [f"pdb {YAW}.external", "n", "c", "break", "continue"]
    status, printed, _ = prompt(*lines)
    assert status == 0
    assert printed.count("--Call--") == 1
    assert f"after {YAW} external" in printed
    assert "no breakpoints" in printed
    assert "the recording ends here" in printed


def test_an_instant_outside_of_the_recording_is_no_place_to_go_to(
    prompt: Prompt,
) -> None:
    ended = prompt("goto 99", "where", "goto 8")
    assert ended.status == Status.BAD_INPUT
    assert "expected an instant from 0 to 8 s" in ended.error
    assert "at 8.000000000 s" in ended.out


@pytest.mark.slow
def test_the_command_line_says_where_to_stop_and_what_to_print(debug: Debug) -> None:
    words = ("--at", "6", "--until", "imu.sample", "--print", "imu", "--print", f"{YAW}.reference")
    _, there, imu, reference = debug(words=words)
    assert there["function"] == "output"
    assert imu["ports"]["sample"] is not None
    assert reference["value"] == 1.0
    debug(words=("--at", "6", "--until", "imu.fault"), status=6)


def test_what_is_wrong_is_said_and_the_next_command_is_taken(prompt: Prompt) -> None:
    wrong = ["stepp", "print controller.yew", "next 0", "goto nowhere", "until imu", "pdb imu", "b"]
    ended = prompt(*wrong, f"next {'9' * 5000}", "next 1 2", "where")
    assert ended.status == Status.BAD_INPUT
    assert len(ended.error.splitlines()) == 8
    assert "did you mean step?" in ended.error
    assert ended.out.count("between two instants") == 2
    assert prompt(words=("--at", "60")).status == Status.BAD_INPUT


def test_commands_list_models_and_themselves_and_leave(debug: Debug) -> None:
    _, models, helped = debug("models yaw", "help", "quit", "where", words=())
    assert models == {"models": {YAW: "Pid"}}
    assert {"where", "print", "quit"} < set(helped["commands"])


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("pr", ["print"]),
        ("print imu.s", ["imu.sample"]),
        ("break controller.yaw.i", ["controller.yaw.internal"]),
        ("print controller.f", ["controller.forces"]),
        ("print controller.i", []),  # a coupled model has no functions
        ("print nobody", []),
    ],
)
def test_the_last_word_of_a_line_is_completed(travel: Travel, line: str, words: list[str]) -> None:
    debugger = Debugger(travel, lambda _: None, lambda *_: None)
    assert Commands(debugger, lambda *_: None).completions(line) == words


@pytest.fixture
def models(travel: Travel) -> Models:
    """The robot's."""
    return Models(travel.player.simulator.root)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *(
            (each, "expected")
            for each in (
                *("__import__('os')", "imu.__class__", "(lambda: 1)()", "[x for x in imu]"),
                *("imu.sample if 1 else 2", "nobody.port > 1", "imu.nothing > 1", "imu"),
                *("imu.sample in 3", "imu.sample >", "abs(1, 2) > 0", ""),
                "(" * 300 + "1" + ")" * 300,
            )
        ),
        ("controller.forces.f5 > 0.4", r"a Forces has no f5; expected one of f1, f2, f3, f4"),
        ("controller.yaw_reference", "passes on what enters"),
    ],
)
def test_a_predicate_is_a_safe_subset_about_what_there_is(
    models: Models, text: str, said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        Predicate(text, models)


def test_a_predicate_looks_at_what_was_sent_at_values_and_attributes(models: Models) -> None:
    seen = Seen()
    sends = Predicate("imu.sample or imu.fault", models)
    above = Predicate(
        "not abs(controller.yaw.command_n) <= 0.5 and controller.yaw.phase == 'x'", models
    )
    plain = Predicate("-1 < controller.yaw.command_n < 1", models)
    assert (sends.of_sending, above.of_sending) == (True, False)
    assert not any(each.holds(seen) for each in (sends, plain))
    seen.sent.add("imu.fault")
    seen.last = {"controller.yaw.command_n": -0.75}
    assert sends.holds(seen)
    assert plain.holds(seen)
    assert not above.holds(seen)
    models.by_path["controller.yaw"].phase = "x"  # type: ignore[attr-defined]
    assert above.holds(seen)


class Gate(Enum):
    OPEN = 1
    SHUT = 2


@pytest.mark.parametrize(
    ("text", "port", "value", "holds"),
    [
        # of a coupled model the port that sends through it
        ("controller.forces.f1 > 0.4", "controller.allocation.forces", Forces(0.5, 0, 0, 0), True),
        ("controller.forces.f1 > 0.6", "controller.allocation.forces", Forces(0.5, 0, 0, 0), False),
        # of an enumeration the member's name
        ("imu.sample == 'OPEN'", "imu.sample", Gate.SHUT, False),
        ("imu.sample == 'OPEN'", "imu.sample", Gate.OPEN, True),
    ],
)
def test_a_predicate_holds_by_the_last_value(
    models: Models, text: str, port: str, value: object, *, holds: bool
) -> None:
    seen = Seen()
    seen.last = {port: value}
    assert Predicate(text, models).holds(seen) is holds


def test_a_field_that_only_a_derived_record_has_is_one_that_a_value_may_have() -> None:
    class Wider(Forces):
        f7 = 0.0

    assert may_have(Forces, "f7")
    assert not may_have(Forces, "f8")
    assert issubclass(Wider, Forces)
