"""Builds of the trolley: as it is, and spoiled in as many ways as there are names here."""

import shutil
from pathlib import Path
from typing import Final, NamedTuple

TROLLEY: Final = Path(__file__).parent / "trolley"
_STEP: Final = "        self.steps += 1\n"
_BUILT: Final = "        self.steps = 0\n"
_IMPORTED: Final = "import math\n"


class Change(NamedTuple):
    """Lines that come after a line of a file."""

    after: str
    lines: str
    file: str = "pace.py"


def _each_step(code: str) -> Change:
    return Change(_STEP, "".join(f"        {line}\n" for line in code.splitlines()))


def _built(code: str) -> Change:
    return Change(_BUILT, "".join(f"        {line}\n" for line in code.splitlines()))


def _imported(code: str) -> Change:
    return Change(_IMPORTED, f"import gc\nimport os\nimport threading\nimport time\n{code}\n")


_AS_SERVICE: Final = "os.getuid() != 0"
"""True in a run as a service, and not where root checks the board before."""

BAD: Final[dict[str, tuple[Change, ...]]] = {
    "a step sleeps for 3 ms": (_each_step("import time; time.sleep(0.003)"),),
    "a step sleeps for 20 ms, two periods": (_each_step("import time; time.sleep(0.02)"),),
    "every tenth step sleeps for 15 ms": (
        _each_step("import time; self.steps % 10 or time.sleep(0.015)"),
    ),
    "a step computes for 3 ms": (
        _each_step(
            "import time; until = time.perf_counter_ns() + 3_000_000\n"
            "while time.perf_counter_ns() < until: pass"
        ),
    ),
    "a step collects all garbage of 200,000 objects": (
        _built("self.kept = [[] for _ in range(200_000)]"),
        _each_step("import gc; gc.unfreeze(); gc.collect()"),
    ),
    "a thread keeps the interpreter busy": (
        _built(
            "import threading\n"
            "def spin() -> None:\n"
            "    while True: sum(range(100_000))\n"
            f"import os; {_AS_SERVICE} and threading.Thread(target=spin, daemon=True).start()"
        ),
    ),
    "the first step raises": (_each_step("raise ValueError('first step')"),),
    "step 500 raises": (_each_step("if self.steps == 500: raise ValueError('step 500')"),),
    "step 500 ends the process": (_each_step("import os; self.steps == 500 and os._exit(0)"),),
    "step 500 kills the process": (
        _each_step("import os; self.steps == 500 and os.kill(os.getpid(), 9)"),
    ),
    "step 500 hangs": (_each_step("while self.steps == 500: pass"),),
    "step 500 sleeps for ten seconds": (
        _each_step("import time; self.steps == 500 and time.sleep(10)"),
    ),
    "its module is no Python": (_imported("this is no Python"),),
    "its module fails for the service's user": (_imported(f"if {_AS_SERVICE}: raise OSError(13)"),),
    "it is not built for the service's user": (
        _built(f"import os\nif {_AS_SERVICE}: raise RuntimeError('not built')"),
    ),
    "it is never ready": (_built(f"import os, time; {_AS_SERVICE} and time.sleep(300)"),),
    "it ends after a second, as if it were done": (
        _each_step("import os, signal; self.steps == 100 and os.kill(os.getpid(), signal.SIGTERM)"),
    ),
    "its controller falls asleep": (
        _each_step("if self.steps == 50: self.passivate('asleep'); return"),
    ),
    "it sends speeds that are no numbers": (
        _each_step("self._speed = math.nan if self.steps > 100 else 0.0"),
    ),
    "it reads its sonar as one of another family": (
        Change(
            "        treads, eye, pace = settings.treads, settings.eye, settings.pace\n",
            "        import msgspec\n        eye = msgspec.structs.replace(eye, family='hrlv')\n",
            "definition.py",
        ),
    ),
}
"""Changes of each, by what is wrong with it."""


def write(folder: Path, version: str, changes: tuple[Change, ...]) -> Path:
    """Write a build of this version, with these changes; return its folder."""
    shutil.copytree(TROLLEY, folder)
    stated = folder / "pyproject.toml"
    _replace(stated, 'version = "1.0.0"', f'version = "{version}"')
    for change in changes:
        _replace(folder / "trolley" / change.file, change.after, change.after + change.lines)
    return folder


def _replace(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{file.name}: {old!r} is there {text.count(old)} times"
    file.write_text(text.replace(old, new), encoding="utf-8")
