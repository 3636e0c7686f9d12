"""A recorded run, instant by instant: what happened, what every model became, back and forth."""

import json
from collections.abc import Callable
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock
from firmware_runtime.live.called import brief
from firmware_runtime.live.rewind import Rewind
from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.start import start_session
from tests.support.allocation import sends
from tests.support.mutated import mutations
from tests.support.recorded import every_section, in_chunks, record, rewrite

TICK = 10 * MILLISECOND


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Seven seconds of a platform that turns, with a keyframe at 5 s."""
    return record(tmp_path_factory.mktemp("flight") / "flight.recording", "tachobot", 7)


@pytest.fixture
def copy(flight: Path, tmp_path: Path) -> Path:
    """That recording, to be damaged."""
    path = tmp_path / "copy.recording"
    path.write_bytes(flight.read_bytes())
    return path


@pytest.fixture(scope="module")
def rewind(flight: Path) -> Rewind:
    return Rewind(flight)


def sent_by(found: dict[str, Any], model: str) -> dict[str, Any]:
    """What a model sent at an instant, by port."""
    events = [each for each in found["events"] if each["model"] == model]
    return dict(pair for each in events for pair in each["sent"])


@pytest.mark.slow
def test_an_instant_has_its_events_states_values_and_transfers(rewind: Rewind) -> None:
    found = rewind.instant(3 * SECOND + TICK // 2)
    assert (found["at"], found["previous"], found["next"]) == (
        3 * SECOND,
        3 * SECOND - TICK,
        3 * SECOND + TICK,
    )
    assert found["note"] is None
    first, *_, last = found["events"]
    assert (first["model"], first["function"]) == ("imu", "output")
    assert first["changed"] == []
    assert last["model"] != "imu"
    yaw = sent_by(found, "controller.yaw")["controller.yaw.command_n"]
    assert found["values"]["controller.yaw.command_n"] == yaw
    assert found["states"]["controller.yaw"] == "waiting"
    assert found["sigma_s"]["imu"] == pytest.approx(0.01)
    assert found["sigma_s"]["controller.yaw"] is None
    (read, written) = found["transfers"]
    assert (read["line"], read["address"], read["device"]) == ("i2c1", 0x68, "imu (MPU-9250)")
    assert len(bytes.fromhex(read["read"])) > len(bytes.fromhex(read["written"])) == 1
    assert (written["device"], written["read"]) == ("thrust_pairs (PCA9685)", "")
    assert read["error"] is None
    assert found["lateness_us"] is None  # in virtual time
    json.dumps(found, allow_nan=False)


@pytest.mark.slow
def test_a_transition_says_what_it_has_changed(rewind: Rewind) -> None:
    found = rewind.instant(3 * SECOND)
    external = next(
        each
        for each in found["events"]
        if (each["model"], each["function"]) == ("controller.yaw", "external")
    )
    assert {"phase", "sigma_s", "command_n"} <= set(external["changed"])
    assert external["state"]["phase"] == "commanding"
    assert external["state"]["command_n"] == found["values"]["controller.yaw.command_n"]


@pytest.mark.slow
def test_every_way_to_an_instant_shows_the_same(flight: Path, rewind: Rewind) -> None:
    at = 5 * SECOND + 3 * TICK  # a keyframe is a little before it
    walked = Rewind(flight)
    instant = walked.instant(0)
    while instant["at"] < at:
        instant = walked.instant(instant["next"])
    jumped = rewind.instant(at)
    assert jumped == instant
    back = Rewind(flight)
    found = back.instant(at + 40 * TICK)
    while found["at"] > at:
        found = back.instant(found["previous"])
    assert found == instant


@pytest.mark.slow
def test_before_the_first_and_after_the_last_are_those(rewind: Rewind) -> None:
    first, last = rewind.instant(-1), rewind.instant(99 * SECOND)
    assert (first["at"], first["previous"], first["index"]) == (rewind.begin_ns, None, 0)
    assert (last["at"], last["next"]) == (rewind.end_ns, None)
    assert [each["what"] for each in first["marks"]][:2] == ["built", "probed"]
    assert last["marks"][-1]["what"].startswith("ended: ")


@pytest.mark.slow
def test_without_a_beginning_there_is_still_what_was_recorded(copy: Path, rewind: Rewind) -> None:
    steps = [each for each in every_section(copy) if kind_of(each) == Kind.STEP]
    rewrite(copy, steps)
    found, whole = Rewind(copy).instant(3 * SECOND), rewind.instant(3 * SECOND)
    assert "cannot be run again here" in found["note"]
    assert "keyframe" in found["note"]
    assert found["states"] == {}
    assert (
        found["values"]["controller.yaw.command_n"] == (whole["values"]["controller.yaw.command_n"])
    )
    assert sent_by(found, "controller.yaw").keys() == sent_by(whole, "controller.yaw").keys()
    assert [each["read"] for each in found["transfers"]] == [
        each["read"] for each in whole["transfers"]
    ]


@pytest.mark.slow
def test_a_part_that_was_written_over_is_said_and_the_rest_is_there(copy: Path) -> None:
    copy.write_bytes(in_chunks(copy, 50))
    chunks = read_recording(copy).chunks
    copy.write_bytes(file_of([each for each in chunks if each.number != 3]))
    holed = Rewind(copy)
    assert holed.faults == ["chunk 3 is missing"]
    assert holed.instant(SECOND // 2)["note"] is None
    assert "keyframe" in holed.instant(3 * SECOND)["note"]
    assert holed.instant(6 * SECOND)["note"] is None
    assert holed.instant(6 * SECOND)["states"]["controller.yaw"] == "waiting"


@pytest.mark.slow
def test_a_run_under_way_is_looked_at_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    board = board_in_force("tachobot", ("recording.minutes=0.1",))
    session = start_session(
        board, VirtualClock(), doubles=True, statistics_path=None, recording=path
    )
    with closing(session):
        session.run_on(SECOND)
        seen = Rewind(path)
        session.run_on(2 * SECOND)
        assert seen.end_ns == SECOND
        assert seen.instant(SECOND)["note"] is None
        assert Rewind(path).end_ns == 2 * SECOND


@pytest.mark.slow
def test_what_a_model_raised_is_shown_where_it_did(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(model: Any, force: float) -> float:  # noqa: ANN401
        model.count = getattr(model, "count", 0) + 1
        if model.count > 100:
            raise ZeroDivisionError("no lever arm")
        return force

    sends(monkeypatch, failing)
    path = tmp_path / "failed.recording"
    record(path, "tachobot", 5)
    failed = Rewind(path)
    last = failed.instant(failed.end_ns)
    assert "no lever arm" in last["events"][-1]["raised"]
    assert "no lever arm" in last["note"]
    assert failed.instant(last["previous"])["note"] is None


@pytest.mark.slow
@pytest.mark.real_time
def test_in_real_time_an_instant_has_its_lateness(tmp_path: Path) -> None:
    path = tmp_path / "real.recording"
    board = board_in_force("tachobot", ("recording.minutes=0.1",))
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=None, recording=path
    )
    with closing(session):
        session.run(SECOND // 5)
    real = Rewind(path)
    found = real.instant(SECOND // 10)
    assert found["lateness_us"] > 0
    assert found["note"] is None


@pytest.mark.slow
def test_a_damaged_recording_is_shown_as_far_as_it_goes_or_refused(
    copy: Path, tmp_path: Path
) -> None:
    damaged = tmp_path / "damaged.recording"
    for number, content in enumerate(islice(mutations(copy, "rewind"), 20)):
        damaged.write_bytes(content)
        try:
            seen = Rewind(damaged)
            found = [seen.instant(at) for at in (0, 3 * SECOND, 3 * SECOND - TICK, SECOND)]
        except ConfigError:
            continue
        assert json.dumps(found, allow_nan=False), f"mutation {number}"


def test_a_recording_without_a_step_is_refused(copy: Path) -> None:
    rewrite(copy, [each for each in every_section(copy) if kind_of(each) == Kind.BUILD])
    with pytest.raises(ConfigError, match="no step"):
        Rewind(copy)


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    path.write_text("no recording")
    with pytest.raises(ConfigError, match="not a recording"):
        Rewind(path)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("x" * 200, lambda found: len(found) == 120 and found.endswith("...")),
        (list(range(40)), lambda found: found[15:] == [15, "... 40 in all"]),
        ({str(n): n for n in range(40)}, lambda found: found["..."] == "40 in all"),
        ([[[[[[1]]]]]], lambda found: found == [[[["..."]]]]),
        ([1, None, 2.5, "a"], lambda found: found == [1, None, 2.5, "a"]),
    ],
)
def test_long_and_deep_values_are_cut(value: object, expected: Callable[[Any], bool]) -> None:
    assert expected(brief(value))
