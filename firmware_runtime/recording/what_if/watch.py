"""Saves of files of a robot's packages, and what is found in a fresh process after each."""

import os
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from time import monotonic_ns, sleep
from typing import Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.replay.outputs import OutputDifference
from firmware_runtime.recording.what_if.checkout import ask
from firmware_runtime.recording.what_if.what_if import Question, WhatIf
from firmware_runtime.recording.what_if.what_if_report import number
from firmware_runtime.system.packages import import_path

_EVERY_S: Final = 0.2
_ENDINGS: Final = (".py", ".toml", ".ma")
_RUNTIME: Final = "firmware_runtime"
_SKIPPED: Final = ("__pycache__", "node_modules")

State = Mapping[str, tuple[int, int]]
"""Time of change and size of each file."""


class Watched:
    """The folders of the packages that modules are in, and the runtime's.

    With a folder of other code, those of its packages that it has. Raises ConfigError for none.
    """

    def __init__(self, folder: Path | None, modules: Iterable[str]) -> None:
        self.folder = folder
        packages = {name.partition(".")[0] for name in modules} | {_RUNTIME}
        found = (_package(each, folder) for each in sorted(packages))
        self.folders = [each for each in found if each is not None]
        if not self.folders:
            expected = f"expected packages {', '.join(sorted(packages))}"
            raise ConfigError.of_one(f"--with {folder}", f"none of the robot's code; {expected}")

    def state(self) -> State:
        """Return the present state of the files."""
        return {path: each for folder in self.folders for path, each in _files(str(folder))}

    def saves(self) -> Iterator[None]:
        """Yield at once, and whenever something has been saved since what was yielded last."""
        while True:
            state = self.state()
            yield
            while self.state() == state:
                sleep(_EVERY_S)


def answers(question: Question, watched: Watched) -> Iterator[tuple[WhatIf | ConfigError, int]]:
    """The answer at once and after every save, or why there is none, and the ns that it took."""
    for _ in watched.saves():
        begun = monotonic_ns()
        try:
            found: WhatIf | ConfigError = ask(question, watched.folder)
        except ConfigError as error:
            found = error
        yield found, monotonic_ns() - begun


def since(before: WhatIf | None, found: WhatIf) -> Iterator[str]:
    """Yield what has changed since the last time, in lines."""
    if before is None:
        return
    changed = [
        name
        for name in found.outputs | before.outputs
        if found.outputs.get(name) != before.outputs.get(name)
    ]
    if not changed:
        yield "as the last time"
        return
    yield f"{len(changed)} outputs and fields are not as the last time:"
    for name in changed[:6]:
        was, now = before.outputs.get(name), found.outputs.get(name)
        yield f"  {name}: {_in_short(was)} -> {_in_short(now)}"


def _in_short(found: OutputDifference | None) -> str:
    if found is None:
        return "as recorded"
    return f"{found.count} differ, rms {number(found.rms)}"


def _package(name: str, folder: Path | None) -> Path | None:
    """Find a package; of one that is a single file the folder that it is in."""
    for each in import_path(folder) if folder is not None else ():
        if (each / name).is_dir():
            return each / name
    if folder is not None:
        return None
    spec = find_spec(name)
    if spec is None:
        return None
    places = list(spec.submodule_search_locations or ())
    return Path(places[0]) if places else Path(spec.origin or name).parent


def _files(folder: str) -> Iterator[tuple[str, tuple[int, int]]]:
    """The files that code is in, without those that an editor or Python makes beside them."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _SKIPPED:
                continue
            try:
                if entry.is_dir(follow_symlinks=False):
                    yield from _files(entry.path)
                elif entry.name.endswith(_ENDINGS):
                    stat = entry.stat()
                    yield entry.path, (stat.st_mtime_ns, stat.st_size)
            except FileNotFoundError:  # an editor replaces it just now
                continue
