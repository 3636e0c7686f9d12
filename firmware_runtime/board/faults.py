"""Faults that no single value shows: two devices at one address, a bus that is not there."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from firmware_runtime.board.settings import (
    BusSettings,
    ExecutiveSettings,
    GuardSettings,
    ModelPolicy,
)
from firmware_runtime.errors import SettingError

PCA9685_ALLCALL = 0x70
"""Every PCA9685 also answers here from power-up until it is told not to."""


class Device(NamedTuple):
    """One chip as the board file has it: its table, chip, bus and address."""

    key: str
    chip: str
    bus: str
    address: int


def unknown_buses(devices: Sequence[Device], buses: Mapping[str, BusSettings]) -> list[str]:
    """Devices on a bus that the file does not describe."""
    known = ", ".join(buses)
    return [
        f"{device.key}.bus: {device.bus!r}: expected one of {known}"
        for device in devices
        if device.bus not in buses
    ]


def address_clashes(devices: Sequence[Device]) -> list[str]:
    """Two devices at one address of one bus, and devices where a PCA9685 listens too."""
    faults: list[str] = []
    taken: dict[tuple[str, int], Device] = {}
    for device in devices:
        other = taken.setdefault((device.bus, device.address), device)
        if other is not device:
            faults.append(
                f"{device.key}.address: 0x{device.address:02x} on {device.bus} is {other.key}'s "
                "already; expected an address of its own"
            )
    return faults + _allcall_clashes(devices)


def _allcall_clashes(devices: Sequence[Device]) -> list[str]:
    buses = {device.bus for device in devices if device.chip == "PCA9685"}
    return [
        f"{device.key}.address: 0x70 on {device.bus} is where every PCA9685 answers from power-up "
        "(ALLCALL); expected another address"
        for device in devices
        if device.address == PCA9685_ALLCALL and device.bus in buses
    ]


def overrun_faults(overruns: Mapping[str, ModelPolicy]) -> list[str]:
    """Policies that stop a late run and do not say how late it is then."""
    return [
        f"overruns.{model}.stop_after_us: missing; policy 'stop' needs it"
        for model, each in overruns.items()
        if each.policy == "stop" and each.stop_after_us is None
    ]


def executive_faults(executive: ExecutiveSettings, guard: GuardSettings) -> list[str]:
    """Times of supervision that contradict each other."""
    if executive.watchdog_s > guard.stall_s:
        return []
    stated = f"executive.watchdog_s: {executive.watchdog_s:g}"
    return [f"{stated}: expected more than guard.stall_s = {guard.stall_s:g}, which comes first"]


def setting_fault(key: str, check: Callable[[], object]) -> list[str]:
    """The sentence of a SettingError that `check` raises, under the key it is about."""
    try:
        check()
    except SettingError as error:
        return [f"{key}: {error}"]
    return []
