"""What runs beside a run keeps off the processors that the board gives to it."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.system.this_process import keep_off, kept_off
from tests.support.bridged_run import Processes
from tests.support.linked_runs import free_port
from tests.support.waiting import wait_until

ALL = os.sched_getaffinity(0)
GIVEN = min(ALL)
OTHERS = ALL - {GIVEN} or ALL
SHIPPED = Path(__file__).parents[2] / "boards/firmware_boards/tachobot/board.toml"


class Beside(Processes):
    """Starts commands on a board that gives one processor to its run."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        super().__init__(folder, stack)
        self.board = folder / "tachobot.toml"
        text = SHIPPED.read_text("utf-8")
        assert text.count("cpus = []") == 1
        self.board.write_text(text.replace("cpus = []", f"cpus = [{GIVEN}]"), "utf-8")

    def on_board(self, verb: str, *words: str) -> int:
        """The number of the command's process."""
        return self.start(*verb.split(), self.board, *words).pid


@pytest.fixture
def beside(tmp_path: Path) -> Iterator[Beside]:
    with ExitStack() as stack:
        yield Beside(tmp_path, stack)


def children(process: int) -> list[int]:
    return [
        int(each) for each in Path(f"/proc/{process}/task/{process}/children").read_text().split()
    ]


@pytest.mark.slow
@pytest.mark.real_time
def test_the_carrier_of_a_run_keeps_off_the_processor_that_is_its_own(
    beside: Beside,
) -> None:
    to = ("--role", "robot", "--link", f"udp:127.0.0.1:{free_port()}")
    run = beside.on_board("run", *to, "--doubles", "--for", "600")
    wait_until(lambda: os.sched_getaffinity(run) == {GIVEN}, "the run is where it belongs")
    (carrier,) = children(run)
    assert os.sched_getaffinity(carrier) == OTHERS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "words"),
    [
        ("recordings collect", ("--into", "kept")),
        ("bridge", ("--listen", "127.0.0.1:0")),
        ("dover", ("--send", "controller.yaw.command_n=62002")),
    ],
)
def test_a_verb_beside_a_run_keeps_off_its_processor(
    beside: Beside, tmp_path: Path, verb: str, words: tuple[str, ...]
) -> None:
    words = tuple(str(tmp_path / word) if word == "kept" else word for word in words)
    process = beside.on_board(verb, *words)
    wait_until(lambda: os.sched_getaffinity(process) == OTHERS, "it keeps off")


def test_only_what_is_started_within_the_block_keeps_off() -> None:
    asked = [sys.executable, "-c", "import os; print(sorted(os.sched_getaffinity(0)))"]
    with kept_off([GIVEN]):
        inside = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    assert inside.strip() == str(sorted(OTHERS))
    assert os.sched_getaffinity(0) == ALL


@pytest.mark.parametrize("given", [(), sorted(ALL), [100_000]])
def test_where_no_other_is_left_or_none_is_given_all_stays_as_it_is(given: list[int]) -> None:
    keep_off(given)
    assert os.sched_getaffinity(0) == ALL
