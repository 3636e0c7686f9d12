"""A run is its replay: every value, every transfer, every count; and what differs is named."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec
import pytest
from firmware_boards.tachobot.allocation import Allocation

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import NoAcknowledge
from firmware_runtime.recording.blackbox.layout import CHUNK, PREFIX_SIZE, Chunk, file_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import decode
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.replay.verdict import replay, verdict_lines
from firmware_runtime.runs.session import Session
from tests.support.recorded import record as record_run
from tests.support.replayed import check_identical, opened, replayed

Record = Callable[..., Path]


@pytest.fixture
def record(tmp_path: Path) -> Record:
    """Record a run in virtual time; `before` is given the session before it begins."""

    def recorded(
        board: str,
        span_s: float = 2,
        settings: Mapping[str, object] = {},
        before: Callable[[Session], None] = lambda _: None,
    ) -> Path:
        stated = ["recording.minutes=10", *(f"{key}={each}" for key, each in settings.items())]
        return record_run(tmp_path / f"{board}.recording", board, span_s, stated, before)

    return recorded


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective", "balancing", "pan_tilt"])
def test_a_run_is_identical_to_its_replay(record: Record, board: str) -> None:
    assert check_identical(record(board), 100).events > 100
    if board == "tachobot":
        for mode in ("platform", "free", "track"):
            check_identical(record(board, settings={"controller.mode": mode}))


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective", "balancing"])
def test_a_replay_begins_in_the_middle_at_a_keyframe(record: Record, board: str) -> None:
    path = record(board, 8)
    late = check_identical(path, 0, Stretch(begin=6 * SECOND))
    assert late.steps < replayed(path).steps
    assert late.duration < 4 * SECOND


def failing(fails: Callable[[int], bool], error: Exception) -> Callable[[Session], None]:
    """Let those transactions of a run's doubles fail, by their number."""

    def break_bus(session: Session) -> None:
        assert session.hardware.rig is not None
        bus = session.hardware.rig.buses["i2c1"]
        carry, count = bus.transaction, iter(range(1_000_000))

        def transaction(address: int, messages: Sequence[Message]) -> bytes:
            if fails(next(count)):
                raise error
            return carry(address, messages)

        bus.transaction = transaction  # type: ignore[method-assign]

    return break_bus


def test_transactions_that_failed_fail_again(record: Record) -> None:
    error = NoAcknowledge("i2c1 address 0x40: not acknowledged")
    check_identical(record("tachobot", before=failing(lambda count: count % 7 == 3, error)))


@pytest.mark.slow
def test_bring_ups_of_a_shared_chip_that_began_again_do_so_from_a_keyframe_too(
    record: Record,
) -> None:
    error = NoAcknowledge("i2c1 address 0x40: not acknowledged")
    path = record("balancing", 6, before=failing(lambda count: count % 500 < 20, error))
    check_identical(path, 10, Stretch(begin=4 * SECOND))


def test_a_world_that_ended_a_run_ends_its_replay(
    record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_of = Session.run

    def run(session: Session, until: int) -> Outcome:
        outcome = run_of(session, until)
        assert isinstance(outcome.error, ModelError)
        return outcome

    break_world = failing(lambda count: count == 150, ZeroDivisionError("float division by zero"))
    monkeypatch.setattr(Session, "run", run)
    path = record("tachobot", before=break_world)
    lines = verdict_lines(opened(path)[0], check_identical(path), 1)
    assert any(line.startswith("  it ended so again: ") for line in lines)


@pytest.mark.slow
def test_other_gains_are_a_difference_with_model_and_both_values(record: Record) -> None:
    recording, _ = opened(record("tachobot"))
    first = replay(recording, board_in_force("tachobot", ("controller.yaw.kp=0.8",))).first
    assert first is not None
    assert (first.what, first.model, first.field) == ("value", "controller.yaw", "command_n")
    assert first.recorded != first.replayed


@pytest.mark.slow
def test_a_damaged_section_is_said_and_what_is_before_it_is_replayed(record: Record) -> None:
    path = record("detective")
    content = bytearray(path.read_bytes())
    used = CHUNK.unpack_from(content, PREFIX_SIZE)[1]
    content[PREFIX_SIZE + used * 9 // 10] ^= 1
    path.write_bytes(content)
    verdict = replayed(path)
    assert (verdict.differences, verdict.is_identical) == (0, False)
    assert verdict.steps > 10
    (fault,) = verdict.faults
    assert "is damaged" in fault


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), -1.0])
def test_a_header_without_a_speed_is_none(record: Record, speed: float) -> None:
    path = record("detective", 0.1)
    (chunk,) = read_recording(path).chunks
    header = decode(chunk.contents[0])
    header.extra["speed"] = speed
    first = msgspec.msgpack.encode(header)
    path.write_bytes(file_of([Chunk(1, [first, *chunk.contents[1:]])]))
    with pytest.raises(ConfigError, match="no chunk of it begins with a whole header"):
        read_recording(path)


@pytest.mark.parametrize("text", ["Dear Sir,", "Friends,", "FWRTBOAT"])
def test_what_is_no_recording_is_refused_by_a_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "letter.recording"
    path.write_text(text)
    with pytest.raises(ConfigError, match="not a recording of a run"):
        read_recording(path)
    with pytest.raises(ConfigError, match="does not exist"):
        read_recording(tmp_path / "none")


def test_a_model_that_ends_the_program_ends_its_replay_as_its_run(
    record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = iter(range(100))
    run_of = Session.run

    def run(session: Session, until: int) -> None:
        with pytest.raises(ModelError, match="SystemExit"):
            run_of(session, until)

    internal = Allocation.internal

    def quits(model: Allocation) -> None:
        if next(count) == 20:
            raise SystemExit(7)
        internal(model)

    monkeypatch.setattr(Session, "run", run)
    monkeypatch.setattr(Allocation, "internal", quits)
    path = record("tachobot")
    count = iter(range(100))
    check_identical(path)


def test_what_ended_a_run_and_is_not_raised_again_is_a_difference(
    record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_: Allocation) -> None:
        raise ValueError("a bug")

    with monkeypatch.context() as patched:
        patched.setattr(Allocation, "internal", fails)
        path = record("tachobot")
    found: list[Difference] = []
    replay(*opened(path), listener=found.append)
    (end,) = (each for each in found if each.what == "end")
    assert (end.where, end.replayed) == ("failure", NOTHING)
    assert "ModelFailure of ValueError" in str(end.recorded)


def test_a_value_that_its_port_refuses_ends_the_replay_as_the_run(record: Record) -> None:
    def send_a_word(session: Session) -> None:
        executive = session.executive
        port = executive.simulator.root.in_ports["yaw_reference"]
        executive.plan(SECOND // 2 + 5, port, "north")

    path = record("tachobot", before=send_a_word)
    assert check_identical(path).duration < SECOND
