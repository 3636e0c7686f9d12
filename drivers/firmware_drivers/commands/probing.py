"""Search for chips on the I2C buses of this machine: read, or left alone with the reason.

Politely: the ways of `firmware_runtime.hal.scan` and `firmware_drivers.catalogue.identity`, on a
bus that no run drives, kept from other runs while it is asked.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from firmware_drivers.catalogue.table import recognise
from firmware_runtime.board.faults import Device
from firmware_runtime.board.registry import Board
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.scan import Answer, State, scan
from firmware_runtime.hal.wire_errors import BusInUse, HalError
from firmware_runtime.system import device_nodes
from firmware_runtime.system.device_nodes import holders
from firmware_runtime.system.kernel_files import SystemFiles


class Found(NamedTuple):
    """Device at one address."""

    address: int
    state: State
    chips: tuple[str, ...]
    """Chips that it is, or could be, as boards name them."""
    certain: bool
    """True if an identity register said so."""
    what: str


class ProbedBus(NamedTuple):
    """One bus: what was found on it, or why it was not asked."""

    device: str
    name: str | None
    """The adapter's."""
    found: Sequence[Found] = ()
    why_not: str | None = None
    """Reason for which it was not read, or not to the end."""
    skipped: bool = False
    """True if it was left alone because it is not a robot's."""

    @property
    def was_asked(self) -> bool:
        """Return whether what was found is all there is."""
        return self.why_not is None


def probe_machine(files: SystemFiles) -> Iterator[ProbedBus]:
    """Every bus of the machine, but those of displays and mainboard, which are named only."""
    for device in sorted(files.matching(device_nodes.NODES), key=lambda node: (len(node), node)):
        whose = device_nodes.not_for_robots(files, device)
        if whose is None:
            yield probe_device(files, device)
        else:
            name = device_nodes.adapter_name(files, device)
            yield ProbedBus(device, name, why_not=f"left alone: it is {whose}", skipped=True)


def probe_device(files: SystemFiles, device: str) -> ProbedBus:
    """One bus by its device node, whatever it is for."""
    name = device_nodes.adapter_name(files, device)
    try:
        bus = open_i2c(device, device, alone=True)
    except BusInUse:
        return ProbedBus(device, name, why_not=_in_use(files, device))
    except HalError as error:
        return ProbedBus(device, name, why_not=str(error).removeprefix(f"{device}: "))
    drivers = {each.address: each.driver for each in device_nodes.bound_addresses(files, device)}
    try:
        return probe_bus(bus, device, name, drivers)
    finally:
        bus.close()


def probe_bus(
    bus: I2cBus, device: str, name: str | None, drivers: dict[int, str] | None = None
) -> ProbedBus:
    """A bus that is open. `drivers` of the kernel hold these addresses."""
    found: list[Found] = []
    try:
        for answer in scan(bus):
            found.append(_found(bus, answer, drivers or {}))  # noqa: PERF401 -- kept on an error
    except HalError as error:
        return ProbedBus(device, name, found, f"not asked to the end: {error}")
    return ProbedBus(device, name, found)


def _found(bus: I2cBus, answer: Answer, drivers: dict[int, str]) -> Found:
    address, state, sentence = answer
    if state is State.HELD:
        driver = drivers.get(address, "of an unknown name")
        what = f"held by the kernel's driver {driver}, and not asked"
        return Found(address, state, (), certain=False, what=what)
    if state is State.FAULTY:
        return Found(address, state, (), certain=False, what=sentence)
    try:
        return Found(address, state, *recognise(bus, address))
    except HalError as error:
        what = f"acknowledges its address, then: {error}"
        return Found(address, State.FAULTY, (), certain=False, what=what)


def _in_use(files: SystemFiles, device: str) -> str:
    """Return the state of one that a run drives, with the process as far as it can be seen."""
    seen, _ = holders(files, [device])
    who = ", ".join(f"{each.command} ({each.process})" for each in seen) or "another process"
    return f"left alone: a run drives it ({who}); stop that run to probe"


class Fit(NamedTuple):
    """One board beside what was found."""

    board: str
    devices: dict[str, str]
    """The device node that suits each of its buses best."""
    present: list[Device]
    missing: list[Device]
    assignments: list[str]
    """Assignments to `--set` where that is another node than the board's file says."""
    uncertain: list[str]
    """Those present without an identity register: another part may answer like them."""
    unasked: list[str]
    """Serial ports: what hangs there cannot be asked."""

    @property
    def fits(self) -> bool:
        """Return whether every chip on a bus was found."""
        return not self.missing


def fit(board: Board, buses: Sequence[ProbedBus]) -> Fit:
    """Compare a board with the buses; each of its own is matched with the best there is."""
    fitted = Fit(board.name, {}, [], [], [], [], [f"ports.{name}" for name in board.ports])
    for name, stated in board.settings.buses.items():
        wanted = [device for device in board.devices if device.bus == name]
        # the stated node first: of equals, max takes the first
        ranked = sorted(buses, key=lambda bus: bus.device != stated.device)
        best = max(ranked, key=lambda bus: _count(wanted, bus), default=None)
        for device in wanted:
            found = None if best is None else _found_of(device, best)
            (fitted.missing if found is None else fitted.present).append(device)
            if found is not None and not found.certain:
                fitted.uncertain.append(device.key)
        if best is not None and _count(wanted, best):
            fitted.devices[name] = best.device
            if best.device != stated.device:
                fitted.assignments.append(f"buses.{name}.device={best.device}")
    return fitted


def _count(wanted: Sequence[Device], bus: ProbedBus) -> int:
    return sum(_found_of(device, bus) is not None for device in wanted)


def _found_of(device: Device, bus: ProbedBus) -> Found | None:
    """Return the chip that the device could be, at its address; None if none could."""
    for found in bus.found:
        if found.address == device.address and device.chip in found.chips:
            return found
    return None
