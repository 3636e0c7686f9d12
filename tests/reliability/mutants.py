"""Mutants of the code that a robot's safety hangs on: how many of them tests notice.

Each is judged by the quick tests that call the function it is in, so those are found first, in one
run of all of them (`--listen` finds them anew). What was tried is kept, so the next run goes on
with others; `--again` tries once more what was not noticed, and by the slow tests too. `--since`
tries all of those that are in lines changed since a commit.
"""

import argparse
import hashlib
import re
import subprocess
import sys
import time
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import chain, zip_longest
from pathlib import Path
from shutil import rmtree
from typing import Final

import msgspec
from msgspec import Struct

from tests.reliability.called import FOLDER, Calls, read_calls
from tests.reliability.changed_lines import changed_lines
from tests.reliability.mutant_server import Answer, Question
from tests.reliability.mutations import Mutant, mutants_in
from tests.reliability.results import BUILD, ROOT, Result, ends_at

ROOMS: Final[Mapping[str, str]] = {
    "drivers": "drivers/firmware_drivers",
    "doubles": "sim_doubles",
    "models": "firmware_runtime/models",
    "devs": "firmware_runtime/devs",
    "executive": "firmware_runtime/executive",
    "hal": "firmware_runtime/hal",
    "guard": "firmware_runtime/runs",
    "recording": "firmware_runtime/recording",
    "statistics": "firmware_runtime/statistics",
}
"""Code that is changed, by a name for it."""
QUICK: Final = "not slow and not real_time and not hardware"
EVERY: Final = "not real_time and not hardware"
_MORE_S: Final = 20.0
_TIMES: Final = 3.0
"""A mutant hangs if its tests take so many times their processor time, and so much more."""
_ENOUGH_S: Final[Mapping[str, float]] = {QUICK: 20.0, EVERY: 60.0}
"""Processor time after which no other test file is begun with, when none is changed."""


class Judged(Struct, frozen=True):
    """A mutant and what became of it: `failed`, `hung` or `survived`."""

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
    parser.add_argument(
        "--again", action="store_true", help="those that survived, by slow tests too"
    )
    parser.add_argument(
        "--since", metavar="COMMIT", help="all of the lines changed since, in place of a sample"
    )
    parser.add_argument("--listen", action="store_true", help="find anew which tests call what")
    parser.add_argument("--workers", type=int, default=2)


def execute(arguments: argparse.Namespace) -> Result:
    """Try mutants, and return what became of all that were tried so far."""
    since: str | None = arguments.since
    if since is not None and arguments.save:
        sys.exit("--since: what is kept is of a sample; expected no --save")
    if since is not None:
        sample = _changed(arguments.rooms, since)
        among = {str(mutant) for _, mutant in sample}
    else:
        sample = _chosen(arguments.rooms, arguments.count, arguments.seed)
        among = None
    log = BUILD / "mutants.jsonl"
    if arguments.listen or not read_calls():
        _listen(arguments.workers)
    judge = _Judge(log, EVERY if arguments.again else QUICK, read_calls())
    until = ends_at(arguments.minutes)
    done = _read(log, among)
    if arguments.again:
        left = [each for each in done.values() if not each.is_noticed]
        chosen = [(each.room, each.mutant) for each in left if each.room in arguments.rooms]
    else:
        chosen = [each for each in sample if str(each[1]) not in done]
    parts = [chosen[number :: arguments.workers] for number in range(arguments.workers)]
    with ThreadPoolExecutor(arguments.workers) as pool:
        for each in [pool.submit(judge.judge_all, part, until) for part in parts]:
            each.result()
    return _result(list(_read(log, among).values()), is_read=not chosen)


def _chosen(rooms: Sequence[str], count: int, seed: int) -> list[tuple[str, Mutant]]:
    """Return so many, the same number of each room as far as it has them.

    They are drawn by their names, so that code which changes elsewhere leaves the others chosen.
    """
    found = _mutants_in(rooms)

    def lot(mutant: Mutant) -> bytes:
        return hashlib.sha256(f"{seed} {mutant}".encode()).digest()

    drawn = [[(room, each) for each in sorted(mutants, key=lot)] for room, mutants in found.items()]
    return [each for each in chain(*zip_longest(*drawn)) if each is not None][:count]


def _changed(rooms: Sequence[str], since: str) -> list[tuple[str, Mutant]]:
    """Return those that are in lines changed since a commit."""
    try:
        lines = changed_lines(ROOT, since)
    except ValueError as error:
        sys.exit(f"--since: {error}")
    return [
        (room, each)
        for room, mutants in _mutants_in(rooms).items()
        for each in mutants
        if not lines.get(each.path, set()).isdisjoint(each.lines)
    ]


def _mutants_in(rooms: Sequence[str]) -> dict[str, list[Mutant]]:
    return mutants_in(ROOT, {room: ROOMS[room] for room in rooms})


def _listen(workers: int) -> None:
    """Run all quick tests once, and let them leave which functions they call."""
    sys.stdout.write("first all quick tests, to see what each calls\n")
    sys.stdout.flush()
    rmtree(FOLDER, ignore_errors=True)
    words = ["-q", "-p", "tests.reliability.called", "-p", "no:cacheprovider", "-m", QUICK]
    many = ["-n", str(workers), "--dist", "loadfile"]
    subprocess.run([sys.executable, "-m", "pytest", *words, *many], cwd=ROOT, check=False)


class _Judge:
    """Tries mutants by the tests that call what they change, and notes each at once."""

    def __init__(self, log: Path, marked: str, calls: Mapping[str, Calls]) -> None:
        self._log = log
        self._marked = marked
        self._calls = calls

    def judge_all(self, chosen: Sequence[tuple[str, Mutant]], until: float) -> None:
        """Try one after the other, in forks of one process."""
        command = [sys.executable, "-m", "tests.reliability.mutant_server"]
        with subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as server:
            assert server.stdin is not None
            assert server.stdout is not None
            for room, mutant in chosen:
                if time.monotonic() >= until:
                    break
                source = (ROOT / mutant.path).read_text(encoding="utf-8")
                if not mutant.compiles(source):
                    continue
                tests = self._tests_of(mutant)
                answer = Answer("survived", "no test calls it")
                if tests:
                    question = self._question(mutant, source, tests)
                    server.stdin.write(msgspec.json.encode(question))
                    server.stdin.write(b"\n")
                    server.stdin.flush()
                    answer = msgspec.json.decode(server.stdout.readline(), type=Answer)
                judged = Judged(room, mutant, answer.outcome, answer.by)
                with self._log.open("ab") as file:
                    file.write(msgspec.json.encode(judged) + b"\n")

    def _question(self, mutant: Mutant, source: str, tests: Sequence[str]) -> Question:
        words = ("-m", self._marked, *tests)
        limit_s = _MORE_S + _TIMES * sum(self._calls[file].took_s for file in tests)
        return Question(str(ROOT / mutant.path), mutant.applied(source), words, limit_s)

    def _tests_of(self, mutant: Mutant) -> list[str]:
        """Return the test files that call what is changed, of the module's own tests first.

        What none calls, as it runs while its module is imported, is judged by all of the module.
        """
        found = self._that_call(mutant.path, mutant.function) or self._that_call(mutant.path, "")
        name = re.compile(rf"\b{re.escape(Path(mutant.path).stem)}\b")

        def order(file: str) -> tuple[bool, float]:
            return name.search(_text(file)) is None, self._calls[file].took_s

        took_s, chosen = 0.0, []
        for file in sorted(found, key=order):
            took_s += self._calls[file].took_s
            chosen.append(file)
            if took_s >= _ENOUGH_S[self._marked]:
                break
        return chosen

    def _that_call(self, path: str, function: str) -> list[str]:
        return [file for file, each in self._calls.items() if _is_called(each, path, function)]


def _is_called(calls: Calls, path: str, function: str) -> bool:
    """Return whether a function is called; of a line that is in none, any of its module."""
    if function:
        return function in calls.functions
    return any(each.startswith(f"{path}:") for each in calls.functions)


@cache
def _text(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


def _read(log: Path, among: Collection[str] | None = None) -> dict[str, Judged]:
    """Return what is kept, by names, of all or of some; of a mutant tried twice the last."""
    if not log.exists():
        return {}
    found = [msgspec.json.decode(line, type=Judged) for line in log.read_bytes().splitlines()]
    by_name = {str(each.mutant): each for each in found}
    return {name: each for name, each in by_name.items() if among is None or name in among}


def _result(judged: Sequence[Judged], *, is_read: bool = False) -> Result:
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
        summary=f"{noticed} of {len(judged)} mutants noticed",
        is_sound=len(judged) > 0 and noticed >= 0.95 * len(judged),
        figures={"tried": len(judged), "noticed": noticed, "rooms": rooms, "survivors": survivors},
        is_read=is_read,
    )
