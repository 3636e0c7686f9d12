"""Boards run and recorded on each machine, all recordings replayed on all, and the matrix."""

import json
import os
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.machines import functions
from tests.vm.commands import Unbuildable

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
_JUDGED: Final = (0, 1)
"""Exit statuses of a certificate that was made."""
COUNT: Final = 20_000
"""Arguments at which each elementary function is compared."""


class Machine(NamedTuple):
    """An interpreter with the project installed."""

    name: str
    program: Path
    is_emulated: bool


def recorded(machine: Machine, folder: Path, say: Callable[[str], None]) -> Iterator[Path]:
    """Run every board of `RUNS` on a machine: what entered its controller, and the whole run."""
    folder.mkdir(parents=True, exist_ok=True)
    say(f"recording: {machine.name}")
    for name, words in RUNS.items():
        if machine.is_emulated and name == REAL_TIME:  # too slow for it
            continue
        part, whole = (
            folder / f"{machine.name}.{each}.recording" for each in (name, f"{name}-whole")
        )
        run = ("run", *words, "--doubles", "--record", str(part))
        for command in (run, ("recordings", "keep", words[0], "-o", str(whole))):
            done = _command(machine, *command)
            if done.returncode:
                raise Unbuildable(f"{machine.name}: {' '.join(command)}: {done.stderr}")
        yield part
        yield whole


def certified(
    machines: Sequence[Machine],
    recordings: Sequence[Path],
    folder: Path,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """The certificate of all machines; each makes its own, the first one merges them."""
    parts = []
    for machine in machines:
        parts.append(folder / f"{machine.name}.json")
        parts[-1].unlink(missing_ok=True)
        say(f"replaying: {machine.name}")
        done = _command(machine, "certify", *map(str, recordings), "-o", str(parts[-1]))
        if not parts[-1].exists():
            raise Unbuildable(f"{machine.name}: {done.stderr}")
    for name in ("certificate.html", "certificate.json"):
        done = _command(machines[0], "certify", *map(str, parts), "-o", str(folder / name))
        if done.returncode not in _JUDGED:
            raise Unbuildable(done.stderr)
    found: dict[str, Any] = json.loads((folder / name).read_text(encoding="utf-8"))
    return found


def matrix_of(machines: Sequence[Machine], document: dict[str, Any]) -> str:
    """The matrix: differing and compared output events, by who recorded and who replayed."""
    names = [machine.name for machine in machines]
    wide = max(map(len, names))
    lines = [f"{'recorded on / replayed on':{wide}}  {'  '.join(names)}"]
    for maker in names:
        cells = [_cell(maker, each["findings"]) for each in document["machines"]]
        padded = (f"{cell:>{len(name)}}" for cell, name in zip(cells, names, strict=True))
        lines.append(f"{maker:{wide}}  {'  '.join(padded)}")
    every = [found for each in document["machines"] for found in each["findings"]]
    events, fields = (sum(found[key] for found in every) for key in ("events", "fields"))
    lines.append(f"{len(every)} replays, {events} output events and {fields} fields compared")
    return "\n".join(lines)


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


def _cell(maker: str, findings: Sequence[dict[str, Any]]) -> str:
    of_maker = [each for each in findings if each["recording"].startswith(f"{maker}.")]
    differing = sum(each["differences"] for each in of_maker)
    lost = sum(each["first"] is not None or each["fault"] is not None for each in of_maker)
    events = sum(each["events"] for each in of_maker)
    return f"{differing} of {events}" + (f", {lost} not identical" if lost else "")


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
