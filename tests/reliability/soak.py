"""Soak: a robot in virtual time for a day with random faults, or in real time for an hour.

After each minute of the robot's time its accounts must hold, and its memory and descriptors must
not have grown; after each ten its recording must have keyframes that can be read, all of it, by
another process, whose memory is not the robot's. A run that a fault ends is counted, and another
one begins.
"""

import argparse
import gc
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Generator, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Final, Literal

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime import FirmwareRuntimeError, open_board
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.strike import KINDS
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.open_board import OpenBoard
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.this_system import allowed_cpus
from tests.reliability.results import Result, commit, in_order, read_kept, summed

BOARDS: Final = ("tachobot", "detective", "balancing", "pan_tilt")
MINUTE_S: Final = 60.0
_FAULTS_A_MINUTE: Final = 2
_READ: Final = 10
"""Minutes after which its recording is read: one that is full takes as long as many of them."""
_SETTLED: Final = 5
"""Minutes after which memory must not grow any more."""
MOST_GROWTH_MB: Final = 24.0
"""Beside the recording's ring, which is a file in memory."""


class Soaked(Struct, kw_only=True):
    """What became of one board."""

    board: str
    commit: str = ""
    """Of the code that ran."""
    robot_s: float = 0.0
    faults: int = 0
    runs: int = 1
    activations: int = 0
    keyframes: int = 0
    growth_mb: float = 0.0
    ended: dict[str, int] = {}
    """How many runs ended by themselves, `stopped` or `failed`."""
    wrong: list[str] = []

    @property
    def name(self) -> str:
        """Return the board."""
        return self.board

    def after(self, earlier: "Soaked") -> "Soaked":
        """Return both: what was wrong before stays so, until it is soaked anew."""
        counts = Counter(earlier.ended) + Counter(self.ended)
        return Soaked(
            board=self.board,
            commit=in_order(earlier.commit, self.commit),
            robot_s=earlier.robot_s + self.robot_s,
            faults=earlier.faults + self.faults,
            runs=earlier.runs + self.runs,
            activations=earlier.activations + self.activations,
            keyframes=self.keyframes,
            growth_mb=max(earlier.growth_mb, self.growth_mb),
            ended=dict(counts),
            wrong=[*earlier.wrong, *self.wrong],
        )


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--hours", type=float, default=24.0, help="of each robot; default 24")
    parser.add_argument("--minutes", type=float, help="of this machine, for all of them together")
    parser.add_argument("--boards", nargs="+", choices=BOARDS, default=list(BOARDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--add", action="store_true", help="to what is kept; choose another --seed")
    parser.add_argument("--real", action="store_true", help="in real time, with the same faults")


def execute(arguments: argparse.Namespace) -> Result:
    """Let the robots run, each in a process of its own: in real time one after the other."""
    boards = arguments.boards
    at_once = 1 if arguments.real else min(len(boards), len(allowed_cpus()))
    limit_s = None
    if arguments.minutes is not None:
        limit_s = 60 * arguments.minutes * at_once / len(boards)
    soak = partial(_soaked, robot_s=3600 * arguments.hours, limit_s=limit_s, is_real=arguments.real)
    found = []
    with ProcessPoolExecutor(at_once, get_context("spawn"), max_tasks_per_child=1) as robots:
        seeds = range(arguments.seed, arguments.seed + len(boards))
        for soaked in robots.map(soak, boards, seeds):
            sys.stdout.write(f"{soaked}\n")
            sys.stdout.flush()
            found.append(soaked)
    name = "soak-real" if arguments.real else "soak"
    kept = read_kept(name) if arguments.add else None
    if kept is not None:
        boards = msgspec.convert(kept.result.figures["boards"], list[Soaked])
        earlier = [replace(each, commit=each.commit or kept.commit) for each in boards]
        found = summed(earlier, found)
    wrong = [f"{each.board}: {fault}" for each in found for fault in each.wrong]
    hours = sum(each.robot_s for each in found) / 3600
    faults = sum(each.faults for each in found)
    return Result(
        name=name,
        summary=f"{hours:.2f} h of {len(found)} robots, {faults} faults, {len(wrong)} wrong",
        is_sound=not wrong,
        figures={"boards": found, "wrong": wrong},
        is_read=kept is not None,
    )


def _soaked(
    board: str, seed: int, *, robot_s: float, limit_s: float | None, is_real: bool
) -> Soaked:
    chance = random.Random(seed)  # noqa: S311 -- to be repeated
    soaked = Soaked(board=board, commit=commit())
    until = time.monotonic() + (limit_s or float("inf"))
    first: tuple[float, int] | None = None
    with (
        tempfile.TemporaryDirectory(dir="/dev/shm") as folder,
        ProcessPoolExecutor(1, get_context("spawn")) as reader,
    ):
        path = Path(folder, "soak.recording")
        minutes = _minutes(board, path, chance, soaked, is_real=is_real)
        for number, robot in enumerate(minutes, 1):
            soaked.wrong += _unaccounted(robot)
            if number % _READ == 1:
                soaked.keyframes = reader.submit(_keyframes, path).result()
                if not soaked.keyframes:
                    soaked.wrong.append("its recording has no keyframe")
            gc.collect()
            now = _memory_mb(), sum(1 for _ in Path("/proc/self/fd").iterdir())
            if number == _SETTLED:
                first = now
            if first is not None:
                soaked.growth_mb = round(now[0] - first[0], 1)
                if soaked.growth_mb > MOST_GROWTH_MB:
                    soaked.wrong.append(f"memory grew by {soaked.growth_mb} MB")
                if now[1] > first[1]:
                    soaked.wrong.append(f"{now[1]} descriptors are open, before {first[1]}")
            if soaked.wrong or soaked.robot_s >= robot_s or time.monotonic() >= until:
                break
        minutes.close()
    return soaked


def _minutes(
    board: str, path: Path, chance: random.Random, soaked: Soaked, *, is_real: bool
) -> Generator[OpenBoard, None, None]:
    """Yield a robot after each minute of its time; after a run that has ended another one."""
    clock: Literal["monotonic", "virtual"] = "monotonic" if is_real else "virtual"
    while True:
        with open_board(board, doubles=True, clock=clock, record=path) as robot:
            done, is_over = 0, False
            while not is_over:
                try:
                    is_over = _minute(robot, chance, soaked)
                except FirmwareRuntimeError as error:
                    soaked.wrong.append(f"raised {type(error).__name__}: {error}")
                    is_over = True
                figures = robot.statistics
                soaked.activations += figures.run - done
                done = figures.run
                yield robot
        soaked.runs += 1


def _minute(robot: OpenBoard, chance: random.Random, soaked: Soaked) -> bool:
    """Run for a minute with a few faults; return whether the run has ended by itself."""
    places = robot.session.hardware.struck.places
    cuts = sorted(chance.random() for _ in range(_FAULTS_A_MINUTE))
    for begin, end in zip([0.0, *cuts], [*cuts, 1.0], strict=True):
        for_s = MINUTE_S * (end - begin)
        before = robot.now
        result = robot.run(for_s)
        soaked.robot_s += (robot.now - before) / SECOND
        if result.state not in {RunState.RUNNING, RunState.ENDED}:
            how = result.state.name.lower()
            soaked.ended[how] = soaked.ended.get(how, 0) + 1
            return True
        place = chance.choice(places)
        kind = KINDS[chance.choice(place.kinds)]
        span_s = None if kind.is_moment else chance.choice((0.05, 0.5, 2.0))
        robot.strike(kind.name, place.name, for_s=span_s)
        soaked.faults += 1
    return False


def _unaccounted(robot: OpenBoard) -> Iterator[str]:
    """Yield the models whose activations are not all accounted for."""
    for name, each in robot.statistics.models.items():
        if each.outstanding:
            yield f"{name}: {each.scheduled} scheduled, not as many accounted for"


def _keyframes(path: Path) -> int:
    """How many a recording has."""
    sections = [each for chunk in read_recording(path).chunks for each in chunk.contents]
    return sum(kind_of(each) == Kind.KEYFRAME for each in sections)


def _memory_mb() -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("RssAnon:"):
            return int(line.split()[1]) / 1024
    return 0.0
