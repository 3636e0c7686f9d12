"""Mutants of the code that a robot's safety hangs on: how many of them tests notice.

Each is judged by the quick tests of its room, those first that import its module. What was tried is
kept, so the next run goes on with others; `--again` tries once more what was not noticed.
"""

import argparse
import random
import re
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import chain, zip_longest
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct

from tests.reliability.mutant_server import Answer, Question
from tests.reliability.mutations import Mutant, mutants_in
from tests.reliability.results import BUILD, ROOT, Result


class Room(Struct, frozen=True):
    """Code, and the folders of its tests."""

    code: tuple[str, ...]
    tests: tuple[str, ...]


ROOMS: Final[Mapping[str, Room]] = {
    "drivers": Room(
        ("drivers/firmware_drivers",),
        ("tests/drivers", "tests/contracts/test_chip_contract.py", "tests/boards"),
    ),
    "doubles": Room(
        ("sim_doubles",),
        ("tests/sim_doubles", "tests/contracts/test_chip_contract.py", "tests/drivers"),
    ),
    "models": Room(("firmware_runtime/models",), ("tests/models", "tests/boards")),
    "devs": Room(("firmware_runtime/devs",), ("tests/devs", "tests/models", "tests/diagram")),
    "executive": Room(("firmware_runtime/executive",), ("tests/executive", "tests/runs")),
    "hal": Room(("firmware_runtime/hal",), ("tests/hal", "tests/sim_doubles", "tests/drivers")),
    "guard": Room(("firmware_runtime/runs",), ("tests/runs", "tests/front_door", "tests/cli")),
    "recording": Room(
        ("firmware_runtime/recording",),
        ("tests/recording", "tests/blackbox", "tests/replay", "tests/exports", "tests/debugger"),
    ),
    "statistics": Room(("firmware_runtime/statistics",), ("tests/statistics",)),
}
QUICK: Final = "not slow and not real_time and not hardware"
_LIMIT_S: Final = 120.0
"""Processor time of the tests of a mutant; one that takes more hangs."""


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
    parser.add_argument("--again", action="store_true", help="those that survived, once more")
    parser.add_argument("--workers", type=int, default=2)


def execute(arguments: argparse.Namespace) -> Result:
    """Try mutants, and return what became of all that were tried so far."""
    log = BUILD / "mutants.jsonl"
    done = _read(log)
    until = None if arguments.minutes is None else time.monotonic() + 60 * arguments.minutes
    if arguments.again:
        chosen = [(each.room, each.mutant) for each in done.values() if not each.is_noticed]
    else:
        chosen = _chosen(arguments.rooms, arguments.count, arguments.seed)
        chosen = [each for each in chosen if each[1] not in done]
    parts = [chosen[number :: arguments.workers] for number in range(arguments.workers)]
    with ThreadPoolExecutor(arguments.workers) as pool:
        for each in [pool.submit(_judge_all, part, log, until) for part in parts]:
            each.result()
    return _result(list(_read(log).values()))


def _chosen(rooms: Sequence[str], count: int, seed: int) -> list[tuple[str, Mutant]]:
    """Return so many, the same number of each room as far as it has them."""
    found = mutants_in(ROOT, {room: ROOMS[room].code for room in rooms})
    chance = random.Random(seed)  # noqa: S311 -- to be repeated
    drawn = [
        [(room, each) for each in chance.sample(mutants, len(mutants))]
        for room, mutants in found.items()
    ]
    return [each for each in chain(*zip_longest(*drawn)) if each is not None][:count]


def _judge_all(chosen: Sequence[tuple[str, Mutant]], log: Path, until: float | None) -> None:
    """Try one after the other, and note each at once."""
    command = [sys.executable, "-m", "tests.reliability.mutant_server"]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        for room, mutant in chosen:
            if until is not None and time.monotonic() >= until:
                break
            path = ROOT / mutant.path
            source = path.read_text(encoding="utf-8")
            if not mutant.compiles(source):
                continue
            words = ("-m", QUICK, *_tests_of(room, mutant.path))
            question = Question(str(path), mutant.applied(source), words, _LIMIT_S)
            server.stdin.write(msgspec.json.encode(question) + b"\n")
            server.stdin.flush()
            answer = msgspec.json.decode(server.stdout.readline(), type=Answer)
            with log.open("ab") as file:
                judged = Judged(room, mutant, answer.outcome, answer.by)
                file.write(msgspec.json.encode(judged) + b"\n")


def _tests_of(room: str, path: str) -> list[str]:
    """Return the test files of a room, those first that import a module, then by their size."""
    module = Path(path).with_suffix("").as_posix().replace("/", ".")
    name = re.sub(r"^(drivers|boards)\.", "", module.removesuffix(".__init__"))
    files = [file for place in ROOMS[room].tests for file in _files(place)]
    last = name.rpartition(".")[2]
    words = re.compile(rf"{re.escape(name)}\b|import .*\b{last}\b")

    def order(file: str) -> tuple[bool, int]:
        text = _text(file)
        return words.search(text) is None, len(text)

    return sorted(files, key=order)


@cache
def _files(place: str) -> tuple[str, ...]:
    path = ROOT / place
    found = [path] if path.is_file() else sorted(path.glob("test_*.py"))
    return tuple(str(each.relative_to(ROOT)) for each in found)


@cache
def _text(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


def _read(log: Path) -> dict[Mutant, Judged]:
    """Return what is kept; of a mutant that was tried twice the last."""
    if not log.exists():
        return {}
    found = [msgspec.json.decode(line, type=Judged) for line in log.read_bytes().splitlines()]
    return {each.mutant: each for each in found}


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
        summary=f"{noticed} of {len(judged)} mutants noticed by quick tests",
        is_sound=len(judged) > 0 and noticed >= 0.95 * len(judged),
        figures={"tried": len(judged), "noticed": noticed, "rooms": rooms, "survivors": survivors},
    )
