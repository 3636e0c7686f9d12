"""Whether this user may use a device node, and by which group it could."""

import grp
import os
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.host.doctor.finding import Finding, failure, not_applicable, ok, warning
from firmware_runtime.host.doctor.machine import Machine


def may_write(path: Path) -> bool:
    """Whether a file may be opened for writing."""
    return os.access(path, os.W_OK)


def owning_group(path: Path) -> str | None:
    """The name of the group a node belongs to; None for root's own or one without a name."""
    try:
        number = path.stat().st_gid
        return grp.getgrgid(number).gr_name if number != 0 else None
    except (OSError, KeyError):
        return None


def nodes_usable(machine: Machine, nodes: Sequence[str]) -> Finding:
    """Whether all of these nodes that exist may be read and written."""
    there = [node for node in nodes if machine.files.exists(node)]
    if not there:
        return not_applicable(f"{', '.join(nodes) or 'no node'}: not there")
    closed = [node for node in there if not os.access(machine.files.path(node), os.R_OK | os.W_OK)]
    if not closed:
        return ok(f"{', '.join(there)}: may be read and written")
    bad = warning if machine.demands is None else failure
    group = owning_group(machine.files.path(closed[0]))
    fix = None if group is None else f"sudo usermod -aG {group} $USER, then log in again"
    return bad(f"{', '.join(closed)}: may not be read and written by this user", fix)
