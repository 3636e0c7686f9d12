"""Mutants of the code that a robot's safety hangs on: how many of them tests notice.

Each is tried in a copy of the checkout, by the quick tests that run its line, and where these pass
by the slow ones of its room. What was tried is kept, so the next run goes on with others.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, zip_longest
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct

from tests.reliability.coverage_map import CoverageMap, measured
from tests.reliability.mutations import Mutant, mutants_in
from tests.reliability.results import BUILD, ROOT, Result

ROOMS: Final[Mapping[str, tuple[str, ...]]] = {
    "drivers": ("drivers/firmware_drivers",),
    "doubles": ("sim_doubles",),
    "models": ("firmware_runtime/models",),
    "devs": ("firmware_runtime/devs",),
    "executive": ("firmware_runtime/executive",),
    "hal": ("firmware_runtime/hal",),
    "guard": ("firmware_runtime/runs",),
    "recording": ("firmware_runtime/recording",),
    "statistics": ("firmware_runtime/statistics",),
}
SLOW_TESTS: Final[Mapping[str, tuple[str, ...]]] = {
    "drivers": ("tests/drivers", "tests/contracts/test_chip_contract.py"),
    "doubles": ("tests/sim_doubles", "tests/contracts/test_chip_contract.py"),
    "models": ("tests/models",),
    "devs": ("tests/devs",),
    "executive": ("tests/executive",),
    "hal": ("tests/hal", "tests/sim_doubles"),
    "guard": ("tests/runs", "tests/front_door"),
    "recording": ("tests/recording", "tests/blackbox", "tests/replay"),
    "statistics": ("tests/statistics",),
}
_IGNORED: Final = shutil.ignore_patterns(
    ".git", ".venv*", "build", "dist", "__pycache__", ".*_cache", "*.egg-info"
)
_QUICK_S: Final = 120.0
"""Most that quick tests take by themselves; a mutant that takes longer hangs."""
_SLOW_S: Final = 400.0
_MOST_TESTS: Final = 60
SURVIVED: Final = "survived"


class Judged(Struct, frozen=True):
    """A mutant and what became of it: `failed`, `hung`, `survived`, or `untested`."""

    room: str
    mutant: Mutant
    outcome: str
    by: str = ""
    """The first test that noticed it."""

    @property
    def is_noticed(self) -> bool:
        """Return whether tests noticed it."""
        return self.outcome in {"failed", "hung"}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--count", type=int, default=2000, help="mutants in all; default 2000")
    parser.add_argument("--seed", type=int, default=1, help="chooses which; default 1")
    parser.add_argument("--minutes", type=float, help="begin no other after so long")
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=list(ROOMS))
    parser.add_argument("--again", action="store_true", help="those that survived, once more")
    parser.add_argument("--workers", type=int, default=2)


def execute(arguments: argparse.Namespace) -> Result:
    """Try mutants, and return what became of all that were tried so far."""
    log = BUILD / "mutants.jsonl"
    done = {each.mutant: each for each in _read(log)}
    until = None if arguments.minutes is None else time.monotonic() + 60 * arguments.minutes
    coverage = measured(ROOT, BUILD / "mutants", _all_tests())
    if arguments.again:
        chosen = [(each.room, each.mutant) for each in done.values() if not each.is_noticed]
    else:
        chosen = _chosen(arguments.rooms, arguments.count, arguments.seed)
        chosen = [(room, mutant) for room, mutant in chosen if mutant not in done]
    with ThreadPoolExecutor(arguments.workers) as pool:
        for number in range(arguments.workers):
            tree = _Tree(BUILD / "mutants" / f"tree{number}", log)
            pool.submit(tree.judge_all, chosen[number :: arguments.workers], coverage, until)
    done |= {each.mutant: each for each in _read(log)}
    return _result(list(done.values()))


def _all_tests() -> list[str]:
    left_out = {"ros2", "safety", "support", "vm", "pi", "updates", "gate", "deployment", "doctor"}
    folders = sorted(each.name for each in (ROOT / "tests").iterdir() if each.is_dir())
    return [f"tests/{name}" for name in folders if name not in left_out]


def _chosen(rooms: Sequence[str], count: int, seed: int) -> list[tuple[str, Mutant]]:
    """Return so many, the same number of each room as far as it has them."""
    found = mutants_in(ROOT, {room: ROOMS[room] for room in rooms})
    drawn = [
        [(room, each) for each in random.Random(seed).sample(mutants, len(mutants))]  # noqa: S311 -- to be repeated
        for room, mutants in found.items()
    ]
    return [each for each in chain(*zip_longest(*drawn)) if each is not None][:count]


class _Tree:
    """A copy of the checkout in which one file at a time is a mutant."""

    def __init__(self, folder: Path, log: Path) -> None:
        self._folder, self._log = folder, log
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(ROOT, folder, ignore=_IGNORED, symlinks=True)
        (folder / ".git").mkdir()  # the tests find the root by it

    def judge_all(
        self, chosen: Sequence[tuple[str, Mutant]], coverage: CoverageMap, until: float | None
    ) -> None:
        """Try one after the other, and note each at once."""
        for room, mutant in chosen:
            if until is not None and time.monotonic() >= until:
                return
            judged = self._judge(room, mutant, coverage)
            with self._log.open("ab") as file:
                file.write(msgspec.json.encode(judged) + b"\n")

    def _judge(self, room: str, mutant: Mutant, coverage: CoverageMap) -> Judged:
        file = self._folder / mutant.path
        source = (ROOT / mutant.path).read_text(encoding="utf-8")
        lines = mutant.before.count("\n")
        quick = coverage.of(mutant.path, mutant.line, mutant.line + lines)[:_MOST_TESTS]
        file.write_text(mutant.applied(source), encoding="utf-8")
        try:
            outcome, by = self._tested(quick, _QUICK_S) if quick else ("untested", "")
            if outcome in {SURVIVED, "untested"}:
                slow = ("-m", "slow and not real_time and not hardware", *SLOW_TESTS[room])
                outcome, by = self._tested(slow, _SLOW_S)
        finally:
            file.write_text(source, encoding="utf-8")
        return Judged(room, mutant, outcome, by)

    def _tested(self, words: Sequence[str], limit_s: float) -> tuple[str, str]:
        command = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-rfE"]
        command += ["-p", "no:cacheprovider", f"--basetemp={self._folder}.tests", *words]
        paths = (self._folder, self._folder / "drivers", self._folder / "boards")
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))}
        environment["PYTHONDONTWRITEBYTECODE"] = "1"
        with subprocess.Popen(
            command,
            cwd=self._folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as process:
            try:
                said, _ = process.communicate(timeout=limit_s)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                return "hung", ""
        if process.returncode == 0:
            return SURVIVED, ""
        noticed = [line for line in said.splitlines() if line.startswith(("FAILED", "ERROR"))]
        return "failed", noticed[0].split(" - ")[0] if noticed else said[-200:]


def _read(log: Path) -> list[Judged]:
    if not log.exists():
        return []
    return [msgspec.json.decode(line, type=Judged) for line in log.read_bytes().splitlines()]


def _result(judged: Sequence[Judged]) -> Result:
    rooms = {}
    for room in ROOMS:
        of_room = [each for each in judged if each.room == room]
        if of_room:
            noticed = sum(each.is_noticed for each in of_room)
            rooms[room] = {"tried": len(of_room), "noticed": noticed}
    survivors = sorted(str(each.mutant) for each in judged if not each.is_noticed)
    noticed = sum(each.is_noticed for each in judged)
    return Result(
        name="mutants",
        summary=f"{noticed} of {len(judged)} mutants noticed, {len(survivors)} not",
        is_sound=len(judged) > 0 and noticed >= 0.95 * len(judged),
        figures={"tried": len(judged), "noticed": noticed, "rooms": rooms, "survivors": survivors},
    )
