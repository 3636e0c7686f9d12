"""A robot whose commander is gone has its outputs off: its commands have stopped coming."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from msgspec.structs import replace

from firmware_runtime.board import registry
from firmware_runtime.board.ends import described, input_timeouts
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.supervision import Commanders
from tests.support.executives import Run
from tests.support.periodic_models import Robot

PORT = "yaw_reference"
HALF_S = SECOND // 2


@contextmanager
def commanded(inputs: dict[str, object]) -> Iterator[Session]:
    """TachoBot on doubles, with something else declared of its inputs."""
    board = replace(registry.load("tachobot"), inputs=inputs)
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    try:
        yield session
        session.end()
    finally:
        session.close()


def command(session: Session, *instants: int) -> None:
    for at in instants:
        session.executive.plan(at, session.robot.model.in_ports[PORT], 0.5)


def is_on(session: Session, at: int) -> bool:
    session.run_on(at)
    outputs = session.outputs()
    assert outputs is not None
    return any(outputs.values())


@pytest.mark.parametrize("inputs", [{}, {PORT: 0.5}])
def test_outputs_are_off_from_the_timeout_on_until_the_next_command(
    inputs: dict[str, object],
) -> None:
    with commanded(inputs) as session:
        command(session, 6 * SECOND, 6 * SECOND + HALF_S - 1, 9 * SECOND)
        assert is_on(session, 7 * SECOND - 20 * MILLISECOND)
        assert not is_on(session, 7 * SECOND)
        assert not is_on(session, 9 * SECOND - 1)
        assert is_on(session, 9 * SECOND + HALF_S - 20 * MILLISECOND)
        assert not is_on(session, 10 * SECOND)
        assert session.arming is not None
        assert session.arming.reason == f"no value has come at input {PORT} for 0.5 s"


def test_a_port_at_which_nothing_came_yet_commands_nothing() -> None:
    with commanded({}) as session:
        assert is_on(session, 3 * SECOND)


def test_what_holds_its_last_value_never_falls_silent() -> None:
    with commanded({PORT: "hold"}) as session:
        command(session, SECOND)
        assert session.arming is None
        assert is_on(session, 3 * SECOND)


def test_the_same_commands_end_in_the_same_instants_twice() -> None:
    def instants() -> list[bool]:
        with commanded({}) as session:
            command(session, SECOND, 4 * SECOND)
            return [is_on(session, at) for at in range(SECOND, 6 * SECOND, SECOND // 10)]

    assert instants() == instants()


def test_each_port_has_its_own_timeout_and_the_first_silence_counts() -> None:
    model, said = Robot(), list[str]()
    run = Run(model, VirtualClock())
    timeouts = {model.command: SECOND, model.in_ports["replan"]: 2 * SECOND}
    commanders = Commanders(run.executive, timeouts, said.append)
    assert commanders.why_silent(10 * SECOND) is None
    run.executive.plan(0, model.command, 1)
    run.executive.plan(0, model.in_ports["replan"], 1)
    run.until(3 * SECOND)
    assert said == ["no value has come at input command for 1 s"]
    assert commanders.why_silent(SECOND - 1) is None


def test_what_a_silence_does_is_said_of_every_port() -> None:
    board = registry.load("tachobot")
    robot = board.unconnected()
    assert input_timeouts(board, robot) == {PORT: None}
    assert described(PORT, None) == "input yaw_reference: holds its last value"
    assert input_timeouts(replace(board, inputs={}), robot) == {PORT: HALF_S}
    expected = "input yaw_reference: outputs are off 0.5 s after its last value"
    assert described(PORT, HALF_S) == expected
