"""Resident memory of TachoBot's process in steady state, beside a bare interpreter with numpy.

A lock may make resident what is mapped and not used, so a process that locks its memory is measured
beside one that does not. With served doubles the process holds what it would on a robot, and
the client's side of a socket instead of a Linux bus.
"""

from pathlib import Path
from typing import Any

from benchmarks.accounting.start import UNLOCKED
from benchmarks.shared.process import MADE, served_doubles, status_of_python, tachobot
from firmware_runtime.statistics.layout import ELAPSED

GOAL_MB = 45.0
STEADY_NS = 2_000_000_000
"""By then TachoBot is up, calibrated and under control."""
_MORE_THAN_NEEDED_S = 60.0
NUMPY = "python with numpy"


def measure(directory: Path) -> dict[str, Any]:
    """Megabytes (10**6 bytes), each of one fresh process; byte code must be there."""
    sizes = {
        "python": megabytes(status_of_python(directory, "pass", "VmRSS")),
        NUMPY: megabytes(status_of_python(directory, "import numpy", "VmRSS")),
        "on doubles": _resident(directory, UNLOCKED, MADE),
        "on doubles, locked": _resident(directory, (), MADE),
    }
    with served_doubles(directory) as doubles:
        sizes["without doubles"] = _resident(directory, UNLOCKED, doubles)
        sizes["without doubles, locked"] = _resident(directory, (), doubles)
    return {
        "megabytes": sizes,
        "goal_mb": GOAL_MB,
        "ratio": sizes["without doubles"] / sizes[NUMPY],
    }


def text(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    lines = ["Resident memory in steady state, MB:"]
    lines += [f"  {name:26}{size:8.1f}" for name, size in result["megabytes"].items()]
    return [
        *lines,
        f"  goal, with numpy: {result['goal_mb']:g} MB or less",
        f"ratio {result['ratio']:.2f} (without doubles, by a bare python with numpy)",
    ]


def _resident(directory: Path, assignments: tuple[str, ...], doubles: tuple[str, ...]) -> float:
    with tachobot(directory, _MORE_THAN_NEEDED_S, assignments, doubles) as running:
        running.read_when(lambda statistics: statistics.cells[ELAPSED] > STEADY_NS)
        return megabytes(running.status_kib("VmRSS"))


def megabytes(kib: int) -> float:
    """KiB as /proc has them, in 10**6 bytes."""
    return kib * 1024 / 1e6
