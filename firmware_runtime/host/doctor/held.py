"""Device nodes that other processes have open."""

from collections.abc import Sequence

from firmware_runtime.host.doctor.finding import Finding, not_applicable, ok, warning
from firmware_runtime.host.doctor.machine import Machine
from firmware_runtime.system.holders import Holder, holders


def held_by_others(machine: Machine, nodes: Sequence[str]) -> Finding:
    """Who else has one of these nodes open, as far as this user can see."""
    there = [node for node in nodes if machine.files.exists(node)]
    if not there:
        return not_applicable(f"{', '.join(nodes) or 'no node'}: not there")
    found, hidden = holders(machine.files, there)
    unseen = f" ({hidden} processes hide their files from this user)" if hidden else ""
    if not found:
        return ok(f"{', '.join(there)}: nobody{unseen}")
    seen = ", ".join(map(_spelled, found))
    return warning(f"{seen}{unseen}", f"kill {' '.join(str(each.process) for each in found)}")


def _spelled(holder: Holder) -> str:
    return f"{holder.node}: {holder.command} ({holder.process})"
