"""Faults that no single value shows: two devices at one address, a bus that no device is on.

A board's definition lists its devices, and what is wrong with them is found here.

Loads of buses follow from what each device repeats.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from os.path import normpath
from typing import TypeVar

from msgspec import Struct, structs

from firmware_runtime.board.robot import Lines, absent_lines
from firmware_runtime.board.settings import (
    BoardSettings,
    BusSettings,
    ExecutiveSettings,
    GuardSettings,
    PortSettings,
)
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction
from firmware_runtime.hal.i2c import Message


class Recurring(Struct, frozen=True):
    """Transactions that a device repeats for as long as the robot runs."""

    bus: str
    what: str
    """The words for people, such as `sonar ranging`."""
    traffic: Sequence[tuple[Message, ...]]
    period: int
    """Ns from one time to the next."""


def bus_loads(
    buses: Mapping[str, BusSettings], recurring: Iterable[Recurring]
) -> dict[str, BusLoad]:
    """The load of every bus, those on which nothing recurs included."""
    asked: dict[str, list[PeriodicTransaction]] = {name: [] for name in buses}
    for each in recurring:
        asked[each.bus] += (
            PeriodicTransaction(each.what, transaction, each.period) for transaction in each.traffic
        )
    return {
        name: BusLoad(name, round(bus.speed_hz), asked[name], bus.overhead_ns)
        for name, bus in buses.items()
    }


PCA9685_ALLCALL = 0x70
"""Every PCA9685 also answers here from power-up until that is switched off."""


class Device(Struct, frozen=True):
    """One chip as the board file has it: its table, chip, bus and address."""

    key: str
    chip: str
    bus: str
    address: int
    stretches_clock: bool = False
    """Whether it may hold the clock low until it has an answer, as a microcontroller does."""


class SerialDevice(Struct, frozen=True):
    """One chip on a serial port as the board file has it: its table, chip and port."""

    key: str
    chip: str
    port: str
    baud: int | None = None
    """The one rate it works at; None if it takes that of the port."""
    address: int | None = None
    """Its own among several on the port; None if it needs the port for itself."""


def device_faults(
    devices: Sequence[Device],
    buses: Mapping[str, BusSettings],
    serial_devices: Sequence[SerialDevice] = (),
    ports: Mapping[str, PortSettings] | None = None,
) -> list[str]:
    """Everything wrong with where devices are: lines not there or shared, clashes, rates."""
    return [
        *unknown_buses(devices, buses),
        *address_clashes(devices),
        *_port_faults(serial_devices, ports or {}),
        *_shared_nodes(buses, ports or {}),
    ]


def unknown_buses(devices: Sequence[Device], buses: Mapping[str, BusSettings]) -> list[str]:
    """Devices on a bus that the file does not describe."""
    known = ", ".join(buses)
    return [
        f"{device.key}.bus: {device.bus!r}: expected one of {known}"
        for device in devices
        if device.bus not in buses
    ]


def _port_faults(devices: Sequence[SerialDevice], ports: Mapping[str, PortSettings]) -> list[str]:
    """Devices on a port that is not there, at another rate, or taken."""
    known = ", ".join(ports) or "none, there is no table [ports]"
    faults: list[str] = []
    for device in devices:
        port = ports.get(device.port)
        if port is None:
            faults.append(f"{device.key}.port: {device.port!r}: expected one of {known}")
        elif device.baud not in {None, port.baud}:
            faults.append(
                f"ports.{device.port}.baud: {port.baud}; the {device.chip} of {device.key} works "
                f"at {device.baud}"
            )
    return faults + _port_clashes(devices)


def _port_clashes(devices: Sequence[SerialDevice]) -> list[str]:
    return [
        f"{device.key}.port: {device.port!r} is {other.key}'s already; expected a port of its own"
        for n, device in enumerate(devices)
        for other in devices[:n]
        if device.port == other.port
        and (None in {device.address, other.address} or device.address == other.address)
    ]


def _shared_nodes(buses: Mapping[str, BusSettings], ports: Mapping[str, PortSettings]) -> list[str]:
    """Two lines on one device node: what clashes on the wire would be seen on neither."""
    nodes = {f"buses.{name}": bus.device for name, bus in buses.items()}
    nodes |= {f"ports.{name}": port.device for name, port in ports.items()}
    taken: dict[str, str] = {}
    return [
        f"{key}.device: {node!r} is that of {other} already; expected a device of its own"
        for key, node in nodes.items()
        if (other := taken.setdefault(normpath(node), key)) != key
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


L = TypeVar("L")


class _Noted(Mapping[str, L]):
    """Lines by their names, and which of them were taken."""

    def __init__(self, lines: Mapping[str, L]) -> None:
        self._lines = lines
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> L:
        self.names.add(name)
        return self._lines[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._lines)

    def __len__(self) -> int:
        return len(self._lines)


def unused_lines(
    settings: BoardSettings,
    build: Callable[[Lines], object] | None,
) -> list[str]:
    """The tables of lines that no other table names and that the robot does not take.

    `build` is None where settings have faults already: then names alone decide. Otherwise the robot
    is built if a line is not named: its wiring may know the name by itself.
    """
    used = set(_texts(settings))
    if build is not None and not used.issuperset([*settings.buses, *settings.ports]):
        used |= _taken([*settings.buses], [*settings.ports], build)
    return [
        f"{table}.{name}: has no effect; no device is on it"
        for table, names in (("buses", settings.buses), ("ports", settings.ports))
        for name in names
        if name not in used
    ]


def _taken(
    buses: Sequence[str], ports: Sequence[str], build: Callable[[Lines], object]
) -> set[str]:
    """The lines that a robot takes while it is built; all, if it cannot be built."""
    absent = absent_lines(buses, ports)
    noted_buses, noted_ports = _Noted(absent.buses), _Noted(absent.ports)
    try:
        build(Lines(noted_buses, noted_ports))
    except Exception:  # noqa: BLE001 -- a defect of its package, named where the robot is needed
        return {*buses, *ports}
    return noted_buses.names | noted_ports.names


def _texts(value: object) -> Iterator[str]:
    """Every text in settings, at any depth."""
    if isinstance(value, str):
        yield value
        return
    if isinstance(value, Struct):
        value = structs.asdict(value)
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        for each in value:
            yield from _texts(each)
