"""The board's serial ports: there, open to this user, and no console."""

from pathlib import Path

from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    nodes_usable,
    not_applicable,
    note,
    ok,
)
from firmware_runtime.host.doctor.i2c import held_by_others

_NO_PORT = "the board has no serial port"


def _present(machine: Machine) -> Finding:
    if machine.demands is not None and not machine.ports:
        return not_applicable(_NO_PORT)
    missing = [node for node in machine.ports if not machine.files.exists(node)]
    if missing:
        return failure(f"{', '.join(missing)} missing")
    there = ", ".join(machine.ports)
    return ok(there) if there else not_applicable("no UART or USB adapter")


def _usable(machine: Machine) -> Finding:
    return nodes_usable(machine, machine.ports) if machine.ports else _none(machine)


def _held(machine: Machine) -> Finding:
    return held_by_others(machine, machine.ports) if machine.ports else _none(machine)


def _none(machine: Machine) -> Finding:
    return not_applicable(_NO_PORT if machine.demands else "no UART or USB adapter")


def _console(machine: Machine) -> Finding:
    if not machine.ports:
        return _none(machine)
    consoles = _consoles(machine)
    if consoles is None:
        return not_applicable("neither the active consoles nor the command line is shown")
    names = {node: {Path(node).name, _real_name(machine, node)} for node in machine.ports}
    taken = [node for node, called in names.items() if called & consoles]
    if not taken:
        return ok(f"consoles: {', '.join(sorted(consoles)) or 'none'}")
    seen = f"{', '.join(taken)}: the kernel writes its messages there"
    return note(seen) if machine.demands is None else failure(seen)


def _real_name(machine: Machine, node: str) -> str:
    """Return what a link such as /dev/serial0 leads to."""
    return machine.files.path(node).resolve().name


def _consoles(machine: Machine) -> set[str] | None:
    """The terminals that are consoles of the kernel; None if that cannot be found out."""
    active = machine.files.text("/sys/class/tty/console/active")
    line = machine.files.text("/proc/cmdline")
    if active is None and line is None:
        return None
    options = (word for word in (line or "").split() if word.startswith("console="))
    named = {word.removeprefix("console=").partition(",")[0] for word in options}
    return named | set((active or "").split())


CHECKS = (
    Check(
        "serial-port",
        "Without the port nothing that is behind it can be reached.",
        "enable_uart=1 in /boot/firmware/config.txt, restart; or another device under [ports] in "
        "board.toml",
        _present,
    ),
    Check(
        "serial-access",
        "A run opens the port as the user it is started by.",
        "sudo usermod -aG dialout $USER, then log in again; SupplementaryGroups=dialout in the "
        "unit",
        _usable,
    ),
    Check(
        "serial-holders",
        "Another program on the port (a login prompt, a modem's daemon) takes bytes that were "
        "ours.",
        "end the process: kill PID; a login prompt: sudo systemctl disable --now "
        "serial-getty@ttyAMA0",
        _held,
    ),
    Check(
        "serial-console",
        "A console sends the kernel's messages to the motor driver, which takes them for commands.",
        "remove console=serial0,115200 from /boot/firmware/cmdline.txt, and sudo systemctl "
        "disable --now serial-getty@ttyAMA0; restart",
        _console,
    ),
)
