"""Builds of the trolley: as it is, and spoiled in as many ways as there are names here."""

import shutil
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

TROLLEY: Final = Path(__file__).parent / "trolley"
_IMPORTED: Final = "import math\n"
_USED: Final = "import gc\nimport os\nimport signal\nimport threading\nimport time\n"
"""Modules that changes use."""


class Change(NamedTuple):
    """Lines that come after a line of a file."""

    after: str
    lines: str
    file: str = "pace.py"


def _within(after: str, code: str) -> Change:
    return Change(after, "".join(f"        {line}\n" for line in code.splitlines()))


_each_step = partial(_within, "        self.steps += 1\n")
_built = partial(_within, "        self.steps = 0\n")


def _imported(code: str) -> Change:
    return Change(_USED, f"{code}\n")


_AS_SERVICE: Final = "os.getuid() != 0"
"""True in a run as a service, and not where root checks the board before."""

BAD: Final[dict[str, tuple[Change, ...]]] = {
    "a step sleeps for 3 ms": (_each_step("time.sleep(0.003)"),),
    "a step sleeps for 20 ms, two periods": (_each_step("time.sleep(0.02)"),),
    "every tenth step sleeps for 15 ms": (_each_step("self.steps % 10 or time.sleep(0.015)"),),
    "a step computes for 3 ms": (
        _each_step(
            "until = time.perf_counter_ns() + 3_000_000\nwhile time.perf_counter_ns() < until: pass"
        ),
    ),
    "a step collects all garbage of 200,000 objects": (
        _built("self.kept = [[] for _ in range(200_000)]"),
        _each_step("gc.unfreeze(); gc.collect()"),
    ),
    "a thread keeps the interpreter busy": (
        _built(
            "def spin() -> None:\n"
            "    while True: sum(range(100_000))\n"
            f"{_AS_SERVICE} and threading.Thread(target=spin, daemon=True).start()"
        ),
    ),
    "the first step raises": (_each_step("raise ValueError('first step')"),),
    "step 500 raises": (_each_step("if self.steps == 500: raise ValueError('step 500')"),),
    "step 500 ends the process": (_each_step("self.steps == 500 and os._exit(0)"),),
    "step 500 kills the process": (_each_step("self.steps == 500 and os.kill(os.getpid(), 9)"),),
    "step 500 hangs": (_each_step("while self.steps == 500: pass"),),
    "step 500 sleeps for ten seconds": (_each_step("self.steps == 500 and time.sleep(10)"),),
    "its module is no Python": (_imported("this is no Python"),),
    "its module fails for the service's user": (_imported(f"if {_AS_SERVICE}: raise OSError(13)"),),
    "it is not built for the service's user": (
        _built(f"if {_AS_SERVICE}: raise RuntimeError('not built')"),
    ),
    "it is never ready": (_built(f"{_AS_SERVICE} and time.sleep(300)"),),
    "it ends after a second, as if it were done": (
        _each_step("self.steps == 100 and os.kill(os.getpid(), signal.SIGTERM)"),
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
    if changes:
        _replace(folder / "trolley/pace.py", _IMPORTED, _IMPORTED + _USED)
    for change in changes:
        _replace(folder / "trolley" / change.file, change.after, change.after + change.lines)
    return folder


def _replace(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{file.name}: {old!r} is there {text.count(old)} times"
    file.write_text(text.replace(old, new), encoding="utf-8")
