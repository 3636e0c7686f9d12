"""Doubles that outlive the runtime: served by one process, driven by another that may be killed."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.support.guarded_run import answer_like_chips
from tests.support.second_choice_board import second_choice_board
from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


@dataclass
class Served:
    """A server under way; `lines` waits for what it logs, with a bound."""

    board: str
    socket: Path
    lines: Iterator[dict[str, Any]]
    process: "subprocess.Popen[str]"

    def run(self, *arguments: str) -> "subprocess.Popen[str]":
        """Start a runtime against it."""
        return subprocess.Popen(
            [*COMMAND, "run", self.board, "--doubles", str(self.socket), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait_for(self, is_it: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Read the log on up to a line that fits."""
        for line in self.lines:
            if is_it(line):
                return line
        pytest.fail(f"nothing that fits was logged in {PATIENCE_S} s")


def turns(output: str) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line.get("output") == output and line["value"] != 0


def stops(output: str) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line.get("output") == output and line["value"] == 0


def is_gone(line: dict[str, Any]) -> bool:
    return line.get("event") == "gone"


@contextmanager
def serving(board: str, folder: Path) -> Iterator[Served]:
    socket, log = folder / "doubles.sock", folder / "doubles.log"
    process = subprocess.Popen(
        [*COMMAND, "doubles", "serve", board, "--socket", str(socket), "--log", str(log)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith("serving ")
    answer_like_chips(process.pid)
    follow = ["timeout", str(PATIENCE_S), "tail", "-n", "+1", "-f", str(log)]
    with subprocess.Popen(follow, stdout=subprocess.PIPE, text=True) as tail:
        try:
            yield Served(board, socket, map(json.loads, tail.stdout or ()), process)
        finally:
            tail.kill()
            process.terminate()
            process.communicate(timeout=PATIENCE_S)


def test_a_robot_runs_on_served_doubles_as_on_its_own(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        runtime = served.run("--for", "5", "--json")
        out, error = runtime.communicate(timeout=PATIENCE_S)
    document = json.loads(out)
    assert (runtime.returncode, error) == (0, "")
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.1)
    assert document["outputs_on"] == {"thrust_pairs": 0}


def test_sigterm_switches_the_served_outputs_off(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        runtime = served.run("--for", "60")
        served.wait_for(turns("thrust_pairs.0"))
        runtime.terminate()
        served.wait_for(stops("thrust_pairs.0"))
        runtime.communicate(timeout=PATIENCE_S)
    assert runtime.returncode == 143


def test_a_pca9685_keeps_its_duties_when_the_runtime_is_killed(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        runtime = served.run("--for", "60")
        served.wait_for(turns("thrust_pairs.0"))
        runtime.kill()
        runtime.communicate(timeout=PATIENCE_S)
        served.wait_for(is_gone)
        served.process.terminate()
        rest = list(iter_until_stopped(served))
    assert not any(stops("thrust_pairs.0")(line) for line in rest)


def iter_until_stopped(served: Served) -> Iterator[dict[str, Any]]:
    for line in served.lines:
        yield line
        if line.get("event") == "stopped":
            return


@pytest.mark.parametrize("second_choice", [False, True], ids=["MD25", "Sabertooth"])
def test_a_motor_driver_stops_by_itself_when_the_runtime_is_killed(
    tmp_path: Path,
    second_choice: bool,  # noqa: FBT001 -- a parameter of the test
) -> None:
    """After a time that the tests of its double measure."""
    board = str(second_choice_board(tmp_path)) if second_choice else "detective"
    with serving(board, tmp_path) as served:
        runtime = served.run("--for", "60")
        served.wait_for(turns("treads.left"))
        runtime.kill()
        runtime.communicate(timeout=PATIENCE_S)
        gone_ns = served.wait_for(is_gone)["t_ns"]
        stopped_ns = served.wait_for(stops("treads.left"))["t_ns"]
    assert stopped_ns > gone_ns


def test_a_socket_that_is_served_is_not_taken_over(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        second = subprocess.run(
            [*COMMAND, "doubles", "serve", "tachobot", "--socket", str(served.socket)],
            capture_output=True,
            text=True,
            check=False,
        )
    assert second.returncode == 2
    assert str(served.socket) in second.stderr


@pytest.mark.parametrize(
    ("arguments", "status"),
    [((), 3), (("--clock", "virtual"), 2), (("--clock", "scaled", "--speed", "2"), 2)],
)
def test_doubles_that_are_not_served_or_not_in_real_time_are_refused(
    tmp_path: Path, arguments: tuple[str, ...], status: int
) -> None:
    path = str(tmp_path / "nosuch.sock")
    ended = subprocess.run(
        [*COMMAND, "run", "tachobot", "--doubles", path, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == status
    assert ended.stderr.count("\n") <= 2
    assert "doubles" in ended.stderr or path in ended.stderr
