"""The board's I2C buses: there, at the right speed, open to this user, and its own."""

import struct
from collections.abc import Sequence

from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    nodes_usable,
    not_applicable,
    note,
    ok,
    warning,
)
from firmware_runtime.system import device_nodes
from firmware_runtime.system.device_nodes import NODES, Bound, Holder, holders
from firmware_runtime.system.kernel_files import kernel_log

_NO_BUS = "no I2C bus"
_LAME = ("bcm2835", "bcm2708")
"""How the names of adapters begin whose hardware mishandles a stretched clock."""
_LONGEST_STRETCH = "/sys/module/i2c_bcm2835/parameters/clk_tout_ms"
_LOGGED = {
    "lost arbitration": "data was low when the adapter had let it go: another master, a chip that "
    "was reset half way, wires too long for the clock",
    "controller timed out": "the adapter's end of a transaction did not come: a chip holds the "
    "clock or data low, or answers too late for the clock",
    "i2c transfer timed out": "the end of a transaction did not come: a chip holds the clock low",
}
"""What drivers of adapters write into the kernel's log: designware of a Raspberry Pi 5, bcm2835."""


def _name(machine: Machine, node: str) -> str | None:
    return device_nodes.adapter_name(machine.files, node)


def _present(machine: Machine) -> Finding:
    files = machine.files
    there = [
        f"{node} ({_name(machine, node) or 'name not shown'})" for node in files.matching(NODES)
    ]
    missing = [node for node in machine.buses if not files.exists(node)]
    seen = ", ".join(there) or _NO_BUS
    if unshown := [node for node in missing if _name(machine, node) is not None]:
        return failure(
            f"{', '.join(unshown)}: the adapter is there, its device node is not: the module "
            "i2c-dev is not loaded",
            "sudo modprobe i2c-dev; echo i2c-dev | sudo tee /etc/modules-load.d/i2c-dev.conf",
        )
    if missing:
        return failure(f"{', '.join(missing)} missing; there are: {seen}")
    if machine.demands is not None and not machine.buses:
        return not_applicable("the board has no I2C bus")
    return ok(seen) if there else note(seen)


def _speed(machine: Machine) -> Finding:
    shown = {node: hz for node in machine.buses if (hz := _clock_hz(machine, node)) is not None}
    if not shown:
        return not_applicable("no device tree states the clock of a bus")
    seen = ", ".join(f"{node} {hz} Hz" for node, hz in shown.items())
    asked = machine.demands.bus_hz if machine.demands else {}
    for node, hz in shown.items():
        if asked.get(node, hz) != hz:
            fix = f"dtparam=i2c_arm_baudrate={asked[node]} in /boot/firmware/config.txt, restart"
            return warning(f"{seen}; the board counts on {asked[node]} Hz for {node}", fix)
    return ok(seen)


def _clock_hz(machine: Machine, node: str) -> int | None:
    """The clock the device tree sets, big-endian as all its numbers."""
    content = machine.files.content(
        device_nodes.adapter_attribute(machine.files, node, "of_node/clock-frequency")
    )
    if content is None or len(content) != 4:
        return None
    (hertz,) = struct.unpack(">I", content)
    return int(hertz)


def _stretching(machine: Machine) -> Finding:
    names = {node: _name(machine, node) for node in machine.buses}
    if not any(names.values()):
        return not_applicable("no adapter whose name is shown")
    lame = {node: name for node, name in names.items() if name and name.startswith(_LAME)}
    if not lame:
        return ok(", ".join(f"{node}: {name}" for node, name in names.items()))
    seen = ", ".join(f"{node}: {name} mishandles it" for node, name in lame.items())
    if (longest := machine.files.integer(_LONGEST_STRETCH)) is not None:
        seen += f", and gives up after {longest} ms (clk_tout_ms)"
    chips = [chip for node in lame for chip in _stretchers(machine, node)]
    return warning(f"{seen}; the board has {', '.join(chips)}") if chips else note(seen)


def _stretchers(machine: Machine, node: str) -> Sequence[str]:
    return machine.demands.stretching.get(node, ()) if machine.demands else ()


def _usable(machine: Machine) -> Finding:
    return nodes_usable(machine, machine.buses)


def _addresses(machine: Machine) -> Finding:
    buses = [node for node in machine.buses if machine.files.exists(node)]
    if not buses:
        return not_applicable(_NO_BUS)
    bound = [each for node in buses for each in device_nodes.bound_addresses(machine.files, node)]
    wanted = [each for each in bound if machine.demands and each[1] in _wanted(machine, each[0])]
    if wanted:
        node, address, driver = wanted[0]
        bus = f"i2c-{device_nodes.adapter_number(machine.files, node)}"
        return failure(
            _spelled(wanted),
            f"echo 0x{address:02x} | sudo tee /sys/bus/i2c/devices/{bus}/delete_device; "
            f"if it is refused, remove the dtoverlay= that loads {driver}",
        )
    if machine.demands is not None:
        return ok("no kernel driver holds an address of the board")
    return note(_spelled(bound)) if bound else ok("no kernel driver holds an address")


def _wanted(machine: Machine, node: str) -> Sequence[int]:
    return machine.demands.addresses.get(node, ()) if machine.demands else ()


def _spelled(bound: Sequence[Bound]) -> str:
    return ", ".join(f"{node} 0x{address:02x}: {driver}" for node, address, driver in bound)


def _held(machine: Machine) -> Finding:
    return held_by_others(machine, machine.buses)


def _logged(machine: Machine) -> Finding:
    lines = kernel_log(machine.files)
    if lines is None:
        return not_applicable("the kernel's log is not shown to this user")
    for said, meaning in _LOGGED.items():
        found = [line for line in lines if said in line and "i2c" in line]
        if found:
            last = found[-1].rpartition(";")[2]
            return warning(f"{len(found)} times since the start, last: {last}: {meaning}")
    return ok("no fault of an adapter in the kernel's log")


CHECKS = (
    Check(
        "i2c-adapter",
        "Without the bus there is no chip. Numbers change between kernels and boards: the "
        "adapter's name says which is which.",
        "dtparam=i2c_arm=on in /boot/firmware/config.txt, i2c-dev in /etc/modules, restart; or "
        "another device under [buses] in board.toml",
        _present,
    ),
    Check(
        "i2c-speed",
        "The bus budget is computed from speed_hz of board.toml; a Raspberry Pi's bus runs at "
        "100 kHz unless set otherwise, and every transaction then takes four times as long. What "
        "is set is not what the wire runs at: 62.5 kHz for 100 where the core clock drops, 650 kHz "
        "for 1 MHz on a Raspberry Pi 5; doctor --measure BOARD times it.",
        "dtparam=i2c_arm_baudrate=400000 in /boot/firmware/config.txt, restart",
        _speed,
    ),
    Check(
        "i2c-clock-stretching",
        "The adapter of a Raspberry Pi 1 to 4 mishandles a chip that holds the clock low to gain "
        "time: bits are lost, and readings are wrong without any error. It gives up (EIO) on one "
        "that holds it longer than clk_tout_ms, 35 ms unless set; other adapters wait.",
        "dtoverlay=i2c-gpio,bus=3,i2c_gpio_sda=2,i2c_gpio_scl=3 in /boot/firmware/config.txt "
        "instead of i2c_arm, and /dev/i2c-3 in board.toml",
        _stretching,
    ),
    Check(
        "i2c-kernel-log",
        "The kernel writes down a transaction whose end did not come, or that another took over; "
        "a Raspberry Pi 5 goes on timing out after it until its supply is cut.",
        "shorter wires, stronger pull-ups, a slower clock: dtparam=i2c_arm_baudrate=100000 in "
        "/boot/firmware/config.txt; cut the supply of Pi and chips once",
        _logged,
    ),
    Check(
        "i2c-access",
        "A run opens the bus as the user it is started by.",
        "sudo usermod -aG i2c $USER, then log in again; SupplementaryGroups=i2c in the unit",
        _usable,
    ),
    Check(
        "i2c-address-bound",
        "An address that a driver of the kernel's holds is refused to every program (EBUSY).",
        "echo 0x68 | sudo tee /sys/bus/i2c/devices/i2c-1/delete_device, or remove the dtoverlay= "
        "that loads the driver",
        _addresses,
    ),
    Check(
        "i2c-holders",
        "Another program on the bus takes its time and may change what our drivers set; a run "
        "that drives the bus already keeps a second one out.",
        "end the process: kill PID, or sudo systemctl stop of its service",
        _held,
    ),
)


def held_by_others(machine: Machine, nodes: Sequence[str]) -> Finding:
    """The other processes with one of these nodes open, as far as this user can see."""
    there = [node for node in nodes if machine.files.exists(node)]
    if not there:
        return not_applicable(f"{', '.join(nodes) or 'no node'}: not there")
    found, hidden = holders(machine.files, there)
    unseen = f" ({hidden} processes hide their files from this user)" if hidden else ""
    if not found:
        return ok(f"{', '.join(there)}: not open in any process{unseen}")
    seen = ", ".join(map(_holder_spelled, found))
    return warning(f"{seen}{unseen}", f"kill {' '.join(str(each.process) for each in found)}")


def _holder_spelled(holder: Holder) -> str:
    return f"{holder.node}: {holder.command} ({holder.process})"
