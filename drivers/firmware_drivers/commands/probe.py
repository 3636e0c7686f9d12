"""`firmware-runtime probe [BUS]`: what answers on the I2C buses, and which board it would fit."""

import argparse
import json
from collections.abc import Sequence

from firmware_drivers.catalogue.table import GROUP, identities
from firmware_drivers.commands.probing import (
    Fit,
    ProbedBus,
    fit,
    probe_bus,
    probe_device,
    probe_machine,
)
from firmware_drivers.commands.single import device_of
from firmware_runtime.board.faults import Device
from firmware_runtime.board.local_settings import known_names
from firmware_runtime.board.rigs import rig_for
from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError, Status, did_you_mean
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.system.kernel_files import THIS_MACHINE

HELP_GROUP = "machine"
HELP_LINE = "Show what answers on the I2C buses."
_ABOUT = """
Addresses are asked as i2cdetect does, by a write of no bytes, or by reading one byte where EEPROMs
live. Then registers are read, but only at addresses where chips with a driver here live; of them
nothing but the number of a register is written. At 0x48 to 0x4b nothing is: a PCF8591 there would
switch its output off. A multiplexer at 0x70 to 0x77 (TCA9548A) closes its channels. Addresses that
a driver of the kernel holds, buses that a run drives, and those of displays and mainboard (unless
named) are left alone.
"""
_NO_BUS = (
    "no I2C bus; on a Raspberry Pi: dtparam=i2c_arm=on in /boot/firmware/config.txt, i2c-dev in "
    "/etc/modules, restart; `firmware-runtime doctor` looks closer"
)


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Show what answers on the I2C buses, what it is, and which board it would fit."
    verb = add_verb(verbs, "probe", summary, execute)
    verb.epilog = _ABOUT
    where = verb.add_mutually_exclusive_group()
    where.add_argument(
        "bus", nargs="?", metavar="BUS", help="a bus by its number or device node; default: all"
    )
    where.add_argument("--doubles", metavar="BOARD", help="the buses of a board's doubles instead")
    verb.add_argument(
        "--board",
        metavar="BOARD",
        help="compare with this board, or the path of your own board.toml; default: all known",
    )
    verb.add_argument("--json", action="store_true", help="print everything as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Probe and print; a bus or more must have been asked for this to count as done."""
    if arguments.doubles is not None:
        probed = _doubles(arguments.doubles)
    elif arguments.bus is not None:
        probed = [probe_device(THIS_MACHINE, device_of(arguments.bus))]
    else:
        probed = list(probe_machine(THIS_MACHINE))
    asked = [bus for bus in probed if bus.was_asked]
    fits, unsound = _fits(_boards(arguments), asked)
    if arguments.json:
        print(json.dumps(_document(probed, fits), indent=2))
    else:
        _print(probed, fits, unsound)
    return Status.OK if asked else Status.NO_DEVICE


def _doubles(name: str) -> list[ProbedBus]:
    board = chosen_board(name)
    bench = rig_for(board, WorldClock())
    return [
        probe_bus(bus, board.settings.buses[name].device, f"{name}, doubles of {board.name}")
        for name, bus in bench.buses.items()
    ]


def _boards(arguments: argparse.Namespace) -> list[str]:
    """The board to compare with, else all that are known; doubles stand for their own board."""
    if arguments.board is not None:
        chosen_board(arguments.board)  # one that is named must be sound
        return [arguments.board]
    known = known_names()
    if arguments.doubles is None:
        return known
    own = chosen_board(arguments.doubles).name
    if own not in known:
        return [arguments.doubles, *known]
    return [arguments.doubles if name == own else name for name in known]


def _fits(compared: Sequence[str], asked: Sequence[ProbedBus]) -> tuple[list[Fit], list[str]]:
    """These boards beside what was found; those whose file is broken by name."""
    fits: list[Fit] = []
    unsound: list[str] = []
    for name in compared:
        try:
            fits.append(fit(chosen_board(name), asked))
        except ConfigError:
            unsound.append(name)
    return fits, unsound


def _print(probed: Sequence[ProbedBus], fits: Sequence[Fit], unsound: Sequence[str]) -> None:
    if not probed:
        print(_NO_BUS)
    for bus in probed:
        print(f"{bus.device} ({bus.name})" if bus.name else bus.device)
        for found in bus.found:
            print(f"  0x{found.address:02x}  {found.what}")
        if bus.was_asked and not bus.found:
            print("  nothing answers")
        if bus.why_not:
            named = f"; `firmware-runtime probe {bus.device}` asks it" if bus.skipped else ""
            print(f"  {bus.why_not}{named}")
    if any(bus.was_asked for bus in probed):
        print()
        for each in fits:
            print(_sentence(each))
        for name in unsound:
            print(f"{name}: its file is not sound, see `firmware-runtime check {name}`")


def _sentence(fitted: Fit) -> str:
    chips = ", ".join(
        f"{each.key} {each.chip} 0x{each.address:02x}" for each in fitted.missing or fitted.present
    )
    settings = "".join(f" --set {each}" for each in fitted.assignments)
    places = ", ".join(fitted.devices.values())
    unasked = f"; not asked: {', '.join(fitted.unasked)}" if fitted.unasked else ""
    if fitted.uncertain:
        unasked = f"; not certain (no identity register): {', '.join(fitted.uncertain)}{unasked}"
    if fitted.fits:
        with_settings = f", with{settings}" if settings else ""
        return f"{fitted.board} fits {places}: {chips}{with_settings}{unasked}"
    total = len(fitted.present) + len(fitted.missing)
    missing = f"{len(fitted.missing)} of {total} chips missing: {chips}"
    return f"{fitted.board} does not fit: {missing}{_unknown(fitted.missing)}"


def _unknown(missing: Sequence[Device]) -> str:
    """Return chips that nothing here could recognise, wherever they are."""
    known = {identity.chip for identity in identities()}
    unknown = sorted({each.chip for each in missing} - known)
    how = f"expected an entry point of the group {GROUP} that does"
    meant = "".join(did_you_mean(each, known) for each in unknown)
    return f"; nothing here recognises {', '.join(unknown)}, {how}{meant}" if unknown else ""


def _document(probed: Sequence[ProbedBus], fits: Sequence[Fit]) -> dict[str, object]:
    return {
        "buses": [_bus(each) for each in probed],
        "boards": {each.board: _fit(each) for each in fits},
    }


def _bus(bus: ProbedBus) -> dict[str, object]:
    return {
        "device": bus.device,
        "name": bus.name,
        "asked": bus.was_asked,
        "why_not": bus.why_not,
        "found": [{**each._asdict(), "state": each.state.value} for each in bus.found],
    }


def _fit(fitted: Fit) -> dict[str, object]:
    found = {"fits": fitted.fits, **fitted._asdict()}
    del found["board"]
    for name in ("present", "missing"):
        found[name] = [_place(device) for device in found[name]]
    return found


def _place(device: Device) -> dict[str, object]:
    return {name: getattr(device, name) for name in ("key", "chip", "bus", "address")}
