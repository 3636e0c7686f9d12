"""Boards run and recorded on each machine, all recordings replayed on all, and the matrix."""

import json
import os
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

from tests.machines import functions
from tests.vm.commands import Unbuildable

Verdict: TypeAlias = dict[str, Any]
"""What `replay --json` prints."""
LIMIT_S: Final = 3600.0
_VIRTUAL: Final = ("--clock", "virtual")
_CIRCLE: Final = ("--set", "controller.mode=track", "--set", "trajectory.kind=circle")
REAL_TIME: Final = "real-time"
RUNS: Final = {
    "tachobot": ("tachobot", "--for", "3", *_VIRTUAL),
    "circle": ("tachobot", "--for", "8", *_CIRCLE, *_VIRTUAL),
    "detective": ("detective", "--for", "5", *_VIRTUAL),
    "balancing": ("balancing", "--for", "2", *_VIRTUAL),
    REAL_TIME: ("tachobot", "--for", "3"),
}
"""Words of `run` for each recording, which is made on doubles."""
COUNT: Final = 20_000
"""Arguments at which each elementary function is compared."""


class Machine(NamedTuple):
    """An interpreter with the project installed."""

    name: str
    program: Path
    is_emulated: bool


def recorded(machine: Machine, folder: Path, say: Callable[[str], None]) -> Iterator[Path]:
    """Run every board of `RUNS` on a machine; yield the recording of each run."""
    folder.mkdir(parents=True, exist_ok=True)
    say(f"recording: {machine.name}")
    for name, words in RUNS.items():
        if machine.is_emulated and name == REAL_TIME:  # too slow for it
            continue
        path = folder / f"{machine.name}.{name}.recording"
        done = _command(machine, "run", *words, "--doubles", "--record", str(path))
        if done.returncode:
            raise Unbuildable(f"{machine.name}: run {' '.join(words)}: {done.stderr}")
        yield path


def replayed(
    machine: Machine, recordings: Sequence[Path], say: Callable[[str], None]
) -> dict[str, Verdict]:
    """What `replay --json` says on a machine of each recording, by the file's name."""
    say(f"replaying: {machine.name}")
    found: dict[str, Verdict] = {}
    for path in recordings:
        done = _command(machine, "replay", str(path), "--json")
        try:
            found[path.name] = json.loads(done.stdout)
        except ValueError as error:
            raise Unbuildable(f"{machine.name}: replay {path}: {done.stderr}") from error
    return found


def matrix_of(verdicts: Mapping[str, Mapping[str, Verdict]]) -> str:
    """The matrix: differences and compared values, by who recorded and who replayed."""
    wide = max(map(len, verdicts))
    lines = [f"{'recorded on / replayed on':{wide}}  {'  '.join(verdicts)}"]
    for maker in verdicts:
        padded = (f"{_cell(maker, found):>{len(name)}}" for name, found in verdicts.items())
        lines.append(f"{maker:{wide}}  {'  '.join(padded)}")
    every = [each for found in verdicts.values() for each in found.values()]
    values, transfers = (sum(each[key] for each in every) for key in ("events", "transfers"))
    lines.append(f"{len(every)} replays, {values} values and {transfers} transfers compared")
    return "\n".join(lines)


def is_same(verdict: Verdict) -> bool:
    """Whether the replay was the run, by the code that had made it."""
    return verdict["identical"] is True and not verdict["code_changed"]


def compared_functions(machines: Sequence[Machine]) -> str:
    """Which elementary functions have other bits on some machine than on the first."""
    words = (functions.__file__, str(COUNT))
    found = [json.loads(_answer(machine, *words)) for machine in machines]
    ours, library = (
        [name for name in found[0][kind] if len({each[kind][name] for each in found}) > 1]
        for kind in ("ours", "library")
    )
    return (
        f"functions at {COUNT} arguments: of the runtime's {len(found[0]['ours'])} differ "
        f"{', '.join(ours) or 'none'}; of the library's {', '.join(library) or 'none'}"
    )


def _cell(maker: str, found: Mapping[str, Verdict]) -> str:
    of_maker = [each for name, each in found.items() if name.startswith(f"{maker}.")]
    differing, values = (sum(each[key] for each in of_maker) for key in ("differences", "events"))
    lost = sum(not is_same(each) for each in of_maker)
    return f"{differing} of {values}" + (f", {lost} not identical" if lost else "")


def _command(machine: Machine, *words: str) -> "subprocess.CompletedProcess[str]":
    return _run(machine, "-P", "-m", "firmware_runtime.cli", *words)


def _answer(machine: Machine, *words: str) -> str:
    done = _run(machine, *words)
    if done.returncode:
        raise Unbuildable(f"{machine.name}: {done.stderr}")
    return done.stdout


def _run(machine: Machine, *words: str) -> "subprocess.CompletedProcess[str]":
    state = machine.program.parents[1] / "state"
    return subprocess.run(
        [str(machine.program), *words],
        env=os.environ | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(state)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
