"""What one board's units need beyond the templates: device nodes, priority, the watchdog's time.

Device nodes are whatever in the board's settings is a text that begins with `/dev/`.
"""

import re
from collections.abc import Iterator
from typing import Any

import msgspec

from firmware_runtime.board.registry import Board
from firmware_runtime.board.settings import ExecutiveSettings
from firmware_runtime.errors import InstallationRefused
from firmware_runtime.host.installation.places import GUARD, ROS2, RUNTIME, settings_path

_DEVICES = "/dev/"
_PLAIN = re.compile(r"/dev/[A-Za-z0-9_.,:+/-]+")
"""What can stand in a unit as it is."""
_HIGHEST = 99
_CPU_LATENCY = "/dev/cpu_dma_latency"


def drop_in(service: str, board: Board, version: str) -> str:
    """The drop-in of a service that opens devices. Raises InstallationRefused."""
    lines = [
        f"# Written by firmware-runtime {version} from {settings_path(board.name)}, and again by",
        f"# every `firmware-runtime service install {board.name}`. Device nodes, priority and",
        "# the watchdog's time belong into that file; other changes: systemctl edit.",
        "[Service]",
        *([] if service == ROS2 else _scheduling(service, board.settings.executive.fifo_priority)),
        *(f"DeviceAllow={node} rw" for node in device_nodes(board)),
    ]
    if service == RUNTIME:
        lines += _of_the_run(board.settings.executive)
    return "\n".join(lines) + "\n"


def device_nodes(board: Board) -> list[str]:
    """The device nodes that a board's settings name, each once, in order."""
    nodes = dict.fromkeys(_texts_below(msgspec.to_builtins(board.settings)))
    for node in nodes:
        if _PLAIN.fullmatch(node) is None or ".." in node:
            raise InstallationRefused(
                f"{node!r} cannot stand in a unit",
                where=board.source,
                expected="a device node such as /dev/i2c-1",
            )
    return list(nodes)


def _scheduling(service: str, priority: int) -> Iterator[str]:
    """The guard has its priority from its start; the run, one lower, sets its own once it is up."""
    own = min(priority + 1, _HIGHEST) if service == GUARD and priority > 0 else priority
    yield f"LimitRTPRIO={own}"
    if service == GUARD:
        yield f"CPUSchedulingPriority={own}" if own > 0 else "CPUSchedulingPolicy=other"


def _of_the_run(executive: ExecutiveSettings) -> Iterator[str]:
    yield f"TimeoutStartSec={executive.bring_up_s:g}s"
    yield f"WatchdogSec={executive.watchdog_s:g}s"
    if executive.keep_cpu_awake:
        yield f"DeviceAllow={_CPU_LATENCY} w"


def _texts_below(value: Any) -> Iterator[str]:  # noqa: ANN401 -- whatever settings hold
    """Every text in a tree of tables and lists that names a device."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for each in value:
            yield from _texts_below(each)
    elif isinstance(value, str) and value.startswith(_DEVICES):
        yield value
