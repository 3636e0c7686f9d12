"""Definition of the board: its schema, its faults, its bus load, and the robot itself."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from firmware_drivers import dc_motor
from firmware_drivers.chips.pca9685_registers import prescale_for
from firmware_drivers.hardware import Identifiable, ReadBack
from firmware_drivers.tables.compass import CompassTable
from firmware_drivers.tables.sonar import SonarTable
from firmware_drivers.tables.treads import TreadTable

from firmware_boards.detective.detective import ATOMIC_CLASSES, Detective
from firmware_boards.detective.experiments import EXPERIMENTS
from firmware_boards.detective.settings import DetectiveSettings, event_parameters
from firmware_boards.detective.wiring import DetectiveRobot
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import (
    Device,
    Recurring,
    SerialDevice,
    bus_loads,
    device_faults,
    setting_fault,
)
from firmware_runtime.board.robot import Lines, Robot, absent_lines
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.ecdpp.atomic_class import known_classes
from firmware_runtime.ecdpp.model_file import read_model
from firmware_runtime.hal.budget import BusLoad


def faults(settings: DetectiveSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    radar = settings.radar_motor
    found = [
        *device_faults(devices(settings), settings.buses, serial_devices(settings), settings.ports),
        *setting_fault(
            "radar_motor.frequency_hz", lambda: prescale_for(radar.frequency_hz, radar.osc_hz)
        ),
    ]
    # Chips and models judge the rest; they can only be built on lines that have a name.
    lines = absent_lines(settings.buses, settings.ports)
    return found or setting_fault("settings", lambda: build(settings, lines))


def loads(settings: DetectiveSettings) -> dict[str, BusLoad]:
    """Return the load of each bus by sensors, treads, and a head that turns."""
    bus, every = settings.radar_motor.bus, dc_motor.WRITTEN_EVERY
    head = Recurring(bus, "radar_motor command", dc_motor.TRAFFIC, every)
    recurring = (each for key, table in _tables(settings) for each in table.recurring(key))
    return bus_loads(settings.buses, (head, *recurring))


def event_model(settings: DetectiveSettings, model_file: Path | None) -> Coupled:
    """The model alone, for event files: the board's own wiring, or what a `.ma` file says.

    Raises ConfigError for a model file with faults.
    """
    if model_file is not None:
        return read_model(model_file, known_classes(ATOMIC_CLASSES))
    return Detective("top", event_parameters(settings))


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
            *((treads.still_on,) if isinstance(treads, ReadBack) else ()),
            model.bridge_chip.still_on,
        ),
        unseen=() if isinstance(treads, ReadBack) else (treads.place,),
        result=lambda: {"found": model.has_found},
        result_from=("mission",),
        ended=model.mission.ended,
        ends_on_failure=settings.mission.on_failure == "end",
        retune=model.retune,
        warnings=(),
    )


def result_text(result: Mapping[str, Any]) -> str:
    """Say in a sentence whether it found its target, and where it stopped, if that is known."""
    stopped_m, time_s = result.get("stopped_m"), result.get("time_s")
    away = "" if stopped_m is None else f" {stopped_m:.2f} m away"
    after = "" if time_s is None else f" after {time_s:.1f} s"
    if result["found"]:
        return f"the detective robot found its target{away and f'{away},'}{after}"
    where = away and f"; it stopped{away}"
    return f"the detective robot did not find its target{where}{after}"


def _identities(model: DetectiveRobot) -> Iterator[Callable[[], None]]:
    """Yield the questions to each chip; nothing on a serial port answers at once."""
    chips = (
        model.treads.driver,
        model.radar_sonar.chip,
        model.body_sonar.chip,
        model.radar_compass.chip,
        model.body_compass.chip,
    )
    for chip in chips:
        if isinstance(chip, Identifiable):
            yield chip.identify


def devices(settings: DetectiveSettings) -> tuple[Device, ...]:
    """Every chip on an I2C bus."""
    radar = settings.radar_motor
    chosen = [table.device(key) for key, table in _tables(settings)]
    return (
        Device("radar_motor", "PCA9685", radar.bus, radar.address),
        *(each for each in chosen if isinstance(each, Device)),
    )


def serial_devices(settings: DetectiveSettings) -> tuple[SerialDevice, ...]:
    """Every chip on a serial port."""
    chosen = [table.device(key) for key, table in _tables(settings)]
    return tuple(each for each in chosen if isinstance(each, SerialDevice))


def _tables(
    settings: DetectiveSettings,
) -> tuple[tuple[str, TreadTable | SonarTable | CompassTable], ...]:
    """The tables of which there are variants, by their keys."""
    return (
        ("treads", settings.treads),
        ("radar_sonar", settings.radar_sonar),
        ("body_sonar", settings.body_sonar),
        ("radar_compass", settings.radar_compass),
        ("body_compass", settings.body_compass),
    )


BOARD = BoardDefinition(
    settings=DetectiveSettings,
    build=build,
    devices=devices,
    serial_devices=serial_devices,
    loads=loads,
    faults=faults,
    event_model=event_model,
    experiments=EXPERIMENTS,
    # with mission.avoid_obstacles; with turn_check; with head_check
    optional_components=(
        "model.Out4",
        "commanded_turn",
        "turn_check",
        "course",
        "course_check",
        "commanded_head",
        "head_check",
    ),
    retunable={
        "treads": ("treads.speed",),
        "radar_motor": ("radar_motor.duty",),
        "commanded_turn": ("treads.speed",),
        "commanded_head": ("radar_motor.duty",),
    },
    doubles_run_s=240.0,  # at most; it ends in front of the target
    result_text=result_text,
)
