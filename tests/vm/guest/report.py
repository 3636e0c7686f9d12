"""Lines to the host: `ok NAME`, `FAILED NAME: why`, and `# remark` in between."""

import os
from collections.abc import Callable
from time import monotonic
from typing import Final, TypeAlias

from tests.vm.guest.machine import Failed

PORT: Final = os.environ.get("RESULTS_PORT", "/dev/virtio-ports/results")

Check: TypeAlias = Callable[[], str | None]
"""Looks at one thing, named by its function; returns what it measured. Raises Failed."""


def say(line: str) -> None:
    """Send one line; what has several is joined."""
    with open(PORT, "w", encoding="utf-8") as port:  # noqa: PTH123 -- a device is no path
        port.write(" | ".join(line.splitlines()) + "\n")


def carry_out(check: Check) -> None:
    """Carry out one check and say how it went."""
    say(verdict(check.__name__.replace("_", " "), check))


def verdict(name: str, check: Check) -> str:
    """Carry out one check; return how it went. What was not foreseen counts as failed."""
    began_at = monotonic()
    try:
        measured = check()
    except Failed as failed:
        return f"FAILED {name}: {failed}"
    except Exception as error:  # noqa: BLE001 -- the other checks are still worth having
        return f"FAILED {name}: {type(error).__name__}: {error}"
    remark = f"; {measured}" if measured else ""
    return f"ok {name} ({monotonic() - began_at:.1f} s{remark})"
