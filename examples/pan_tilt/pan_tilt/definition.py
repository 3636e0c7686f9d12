"""What the runtime asks of a board: its schema, its faults, its bus load, and the robot itself."""

from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

from firmware_drivers.chips import ads1115

from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import Device, Recurring, bus_loads, device_faults, setting_fault
from firmware_runtime.board.robot import Lines, Robot, absent_lines
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.hal.budget import BusLoad
from pan_tilt.adafruit_eyes import GAINS
from pan_tilt.follow_check import PATIENCE
from pan_tilt.settings import EyesTable, PanTiltSettings
from pan_tilt.wiring import INPUTS, PanTilt, chip_settings, servos_settings


def devices(settings: PanTiltSettings) -> tuple[Device, ...]:
    """Every chip, with its table, bus and address."""
    return (
        Device("eyes", "ADS1115", settings.eyes.bus, settings.eyes.address),
        Device("servos", "PCA9685", settings.servos.bus, settings.servos.address),
    )


def faults(settings: PanTiltSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    servos = settings.servos
    found = [
        *_adafruit_faults(settings.eyes),
        *_period_faults(settings.eyes),
        *device_faults(devices(settings), settings.buses),
        *(f"eyes.{fault}" for fault in chip_settings(settings.eyes).faults()),
        *(f"servos.{fault}" for fault in servos_settings(servos).faults(servos.osc_hz)),
    ]
    # Chips and models judge the rest; they can only be built on buses that are there.
    absent = absent_lines(settings.buses)
    return found or setting_fault("eyes.period_s", lambda: PanTilt(settings, absent))


def _period_faults(eyes: EyesTable) -> list[str]:
    """What keeps a head that does not turn as told from being found."""
    if seconds(eyes.period_s) < PATIENCE:
        return []
    expected = f"expected less than {PATIENCE / SECOND:g} s, in which the head has come nearer"
    return [f"eyes.period_s: {eyes.period_s} s, {expected}"]


def _adafruit_faults(eyes: EyesTable) -> list[str]:
    """What keeps Adafruit's driver from being used, where it is chosen."""
    if eyes.driver == "own":
        return []
    if find_spec("adafruit_ads1x15") is None:
        return ["eyes.driver: 'adafruit' needs the package adafruit-circuitpython-ads1x15"]
    if eyes.full_scale_v not in GAINS:
        choices = ", ".join(map(str, GAINS))
        return [f"eyes.full_scale_v: {eyes.full_scale_v}, with this driver one of {choices}"]
    return []


def loads(settings: PanTiltSettings) -> dict[str, BusLoad]:
    """What recurs on each bus: four conversions, a command that follows, pulses written again."""
    eyes, servos = settings.eyes, settings.servos
    conversions = ads1115.TRAFFIC * len(INPUTS)
    pulses = servos_settings(servos).traffic
    recurring = (
        Recurring(eyes.bus, "eyes reading", conversions, seconds(eyes.period_s)),
        Recurring(servos.bus, "servos command", pulses, seconds(eyes.period_s)),
        Recurring(servos.bus, "servos pulses", pulses, seconds(servos.period_s)),
    )
    return bus_loads(settings.buses, recurring)


def build(settings: PanTiltSettings, lines: Lines) -> Robot:
    """The robot on these buses; nothing is sent yet."""
    model = PanTilt(settings, lines)
    return Robot(
        model=model,
        # The PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(model.pwm_chip.silence, model.pwm_chip.identify, model.adc_chip.identify),
        stop=(model.pwm_chip.stop_all,),
        still_on=(model.pwm_chip.still_on,),
        result=lambda: {"following": model.controller.head.is_following is True},
        result_from=("controller",),
        ended=model.controller.ended,
        ends_on_failure=True,
        retune=model.controller.retune,
        warnings=(),
    )


def result_text(result: Mapping[str, Any]) -> str:
    """What the head did, for the last lines of a run: the light, and how far beside it it looks."""
    does = "follows a light" if result["following"] else "sees no light"
    error_rad = result.get("error_rad")  # the rig's: the head itself cannot know
    beside = "" if error_rad is None else f", and looks {error_rad:.2f} rad beside it"
    return f"the head {does}{beside}"


BOARD = BoardDefinition(
    settings=PanTiltSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    retunable={
        "controller": ("controller.kp", "controller.ki", "controller.kd", "controller.most_rad_s"),
    },
    doubles_run_s=15.0,
    result_text=result_text,
)
