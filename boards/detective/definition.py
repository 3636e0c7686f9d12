"""What the runtime asks of a board: its schema, its faults, its bus load, and the robot itself."""

from collections.abc import Callable, Iterator
from pathlib import Path

from boards.detective.detective import ATOMIC_CLASSES, Detective
from boards.detective.parameters import Parameters
from boards.detective.settings import CompassTable, DetectiveSettings, SonarTable
from boards.detective.wiring import DetectiveRobot
from drivers.chips import cmps12, hmc5883l, maxbotix, md25, srf08
from drivers.chips.cmps12 import Cmps12
from drivers.chips.hmc5883l import Hmc5883l
from drivers.chips.md25 import Md25
from drivers.chips.pca9685 import prescale_for
from drivers.chips.srf08 import Srf08
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import Device, address_clashes, setting_fault, unknown_buses
from firmware_runtime.board.lines import Lines
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import seconds
from firmware_runtime.ecdpp.model_file import read_model
from firmware_runtime.hal.absent import AbsentBus, AbsentPort
from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction
from firmware_runtime.hal.i2c import Message

_SONARS = ("radar_sonar", "body_sonar")
_COMPASSES = ("radar_compass", "body_compass")


def faults(settings: DetectiveSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    chips = devices(settings)
    radar = settings.radar_motor
    found = [
        *_missing(settings),
        *unknown_buses(chips, settings.buses),
        *address_clashes(chips),
        *setting_fault(
            "radar_motor.frequency_hz", lambda: prescale_for(radar.frequency_hz, radar.osc_hz)
        ),
    ]
    # Chips and models judge the rest; they can only be built on lines that have a name.
    return found or setting_fault("settings", lambda: build(settings, _absent(settings)))


def loads(settings: DetectiveSettings) -> dict[str, BusLoad]:
    """What the sensors and the treads cost on each bus."""
    asked: dict[str, list[PeriodicTransaction]] = {name: [] for name in settings.buses}
    for bus, what, traffic, period_s in _periodic(settings):
        asked[bus] += (PeriodicTransaction(what, each, seconds(period_s)) for each in traffic)
    return {
        name: BusLoad(name, round(bus.speed_hz), asked[name], bus.overhead_ns)
        for name, bus in settings.buses.items()
    }


def event_model(settings: DetectiveSettings, model_file: Path | None) -> Coupled:
    """The model alone, for event files: the board's own wiring, or what a `.ma` file says.

    Raises ConfigError for a model file with faults.
    """
    if model_file is not None:
        return read_model(model_file, ATOMIC_CLASSES)
    model = settings.model
    parameters = Parameters(seconds(model.hop_s), seconds(model.half_sweep_s), model.tolerance_deg)
    return Detective("top", parameters)


def build(settings: DetectiveSettings, lines: Lines) -> Robot:
    """The robot on these lines; nothing is sent yet."""
    model = DetectiveRobot(settings, lines)
    treads = model.treads.driver
    return Robot(
        model=model,
        # The PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(model.bridge_chip.silence, model.bridge_chip.identify, *_identities(model)),
        stop=(treads.stop, model.bridge_chip.stop_all),
        still_on=(
            *((treads.still_on,) if isinstance(treads, Md25) else ()),
            model.bridge_chip.still_on,
        ),
        unseen=() if isinstance(treads, Md25) else (treads.place,),
        result=lambda: {"found": model.has_found},
        ended=model.mission.ended,
        ends_on_failure=settings.mission.on_failure == "end",
        retune=model.retune,
        warnings=(),
    )


def _identities(model: DetectiveRobot) -> Iterator[Callable[[], None]]:
    """What each chip on a bus can be asked; nothing on a serial port answers at once."""
    devices = (
        model.treads.driver,
        model.radar_sonar.chip,
        model.body_sonar.chip,
        model.radar_compass.chip,
        model.body_compass.chip,
    )
    for device in devices:
        if isinstance(device, Md25 | Srf08 | Cmps12 | Hmc5883l):
            yield device.identify


def devices(settings: DetectiveSettings) -> tuple[Device, ...]:
    """Every chip on an I2C bus whose bus and address are known."""
    return tuple(_devices(settings))


def _devices(settings: DetectiveSettings) -> Iterator[Device]:
    radar, treads = settings.radar_motor, settings.treads
    yield Device("radar_motor", "PCA9685", radar.bus, radar.address)
    if treads.driver == "md25" and treads.bus is not None and treads.address is not None:
        yield Device("treads", "MD25", treads.bus, treads.address)
    for key in _SONARS:
        sonar: SonarTable = getattr(settings, key)
        if sonar.chip == "srf08" and sonar.bus is not None and sonar.address is not None:
            yield Device(key, "SRF08", sonar.bus, sonar.address)
    for key in _COMPASSES:
        compass: CompassTable = getattr(settings, key)
        address = hmc5883l.ADDRESS if compass.chip == "hmc5883l" else compass.address
        if address is not None:
            yield Device(key, compass.chip.upper(), compass.bus, address)


def _missing(settings: DetectiveSettings) -> Iterator[str]:
    """What the chosen chip needs and the file does not say, and ports it does not describe."""
    tables = [("treads", settings.treads, settings.treads.driver)]
    tables += [(key, getattr(settings, key), getattr(settings, key).chip) for key in _SONARS]
    for key, table, chip in tables:
        wanted = ("port",) if chip in {"sabertooth", "maxbotix"} else ("bus", "address")
        for name in wanted:
            if getattr(table, name) is None:
                yield f"{key}.{name}: missing; a chip {chip!r} needs it"
        if "port" in wanted and table.port is not None and table.port not in settings.ports:
            known = ", ".join(settings.ports) or "none, there is no table [ports]"
            yield f"{key}.port: {table.port!r}: expected one of {known}"
    for key in _SONARS:
        sonar: SonarTable = getattr(settings, key)
        port = settings.ports.get(sonar.port or "")
        if sonar.chip == "maxbotix" and port is not None and port.baud != maxbotix.BAUD:
            expected = f"the MaxBotix of {key} sends at {maxbotix.BAUD}"
            yield f"ports.{sonar.port}.baud: {port.baud}; {expected}"
    for key in _COMPASSES:
        compass: CompassTable = getattr(settings, key)
        if compass.chip == "cmps12" and compass.address is None:
            yield f"{key}.address: missing; a chip 'cmps12' needs it"


def _periodic(
    settings: DetectiveSettings,
) -> Iterator[tuple[str, str, tuple[tuple[Message, ...], ...], float]]:
    """Bus, what, transactions and period of everything that recurs."""
    treads = settings.treads
    if treads.driver == "md25":
        yield str(treads.bus), "treads speeds", md25.TRAFFIC, treads.refresh_s
    for key in _SONARS:
        sonar: SonarTable = getattr(settings, key)
        if sonar.chip == "srf08":
            yield str(sonar.bus), f"{key} ranging", srf08.TRAFFIC, sonar.period_s
    for key in _COMPASSES:
        compass: CompassTable = getattr(settings, key)
        traffic = cmps12.TRAFFIC if compass.chip == "cmps12" else hmc5883l.TRAFFIC
        yield compass.bus, f"{key} heading", traffic, compass.period_s


def _absent(settings: DetectiveSettings) -> Lines:
    return Lines(
        {name: AbsentBus(name) for name in settings.buses},
        {name: AbsentPort(name) for name in settings.ports},
    )


BOARD = BoardDefinition(
    settings=DetectiveSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    event_model=event_model,
    retunable=("treads.speed", "radar_motor.duty"),
    doubles_run_s=240.0,  # at most; it ends in front of the target
)
