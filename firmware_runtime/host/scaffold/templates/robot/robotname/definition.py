"""What the runtime asks of a board: its schema, its faults, its bus load, and the robot itself."""

from firmware_drivers import dc_motor
from firmware_drivers.chips import srf08
from firmware_drivers.chips.pca9685_rate import prescale_for

from firmware_runtime.board.bus_loads import Recurring, bus_loads
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import Device, device_faults, setting_fault
from firmware_runtime.board.lines import Lines, absent_lines
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.time import seconds
from firmware_runtime.hal.budget import BusLoad

from robotname.result import result
from robotname.settings import RobotNameSettings
from robotname.wiring import RobotName


def devices(settings: RobotNameSettings) -> tuple[Device, ...]:
    """Every chip, with its table, bus and address."""
    return (
        Device("motor", "PCA9685", settings.motor.bus, settings.motor.address),
        Device("sonar", "SRF08", settings.sonar.bus, settings.sonar.address, stretches_clock=True),
    )


def faults(settings: RobotNameSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    motor = settings.motor
    found = [
        *device_faults(devices(settings), settings.buses),
        *setting_fault(
            "motor.frequency_hz", lambda: prescale_for(motor.frequency_hz, motor.osc_hz)
        ),
        *_time_faults(settings),
    ]
    # Chips and models judge the rest; they can only be built on buses that are there.
    lines = absent_lines(settings.buses)
    return found or setting_fault("settings", lambda: RobotName(settings, lines))


def _time_faults(settings: RobotNameSettings) -> list[str]:
    """Times that would be over before the next echo comes."""
    least_s = 2 * settings.sonar.period_s
    stated = {
        "motor.timeout_s": settings.motor.timeout_s,
        "controller.lost_s": settings.controller.lost_s,
    }
    return [
        f"{key}: {span_s:g} s, expected two periods of the sonar ({least_s:g} s) or more"
        for key, span_s in stated.items()
        if span_s < least_s
    ]


def loads(settings: RobotNameSettings) -> dict[str, BusLoad]:
    """What recurs on each bus: the sonar's rangings, each followed by a command to the motor."""
    sonar, motor, period = settings.sonar, settings.motor, seconds(settings.sonar.period_s)
    recurring = (
        Recurring(sonar.bus, "sonar ranging", srf08.TRAFFIC, period),
        Recurring(motor.bus, "motor drive", dc_motor.TRAFFIC, period),
    )
    return bus_loads(settings.buses, recurring)


def build(settings: RobotNameSettings, lines: Lines) -> Robot:
    """The robot on these buses; nothing is sent yet."""
    model = RobotName(settings, lines)
    controller = model.controller
    return Robot(
        model=model,
        # The PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(model.pwm_chip.silence, model.pwm_chip.identify, model.sonar_chip.identify),
        stop=(model.pwm_chip.stop_all,),
        still_on=(model.pwm_chip.still_on,),
        result=lambda: result(controller.pid.reference, controller.tracker.motion),
        result_from=("controller",),
        retune=lambda changed: controller.retune(changed.controller),
        shown=model.sonar.distance_out,
    )


BOARD = BoardDefinition(
    settings=RobotNameSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    retunable={
        "controller": ("controller.kp", "controller.ki", "controller.kd", "controller.max_drive"),
    },
    inputs={"distance_m": "hold"},
    doubles_run_s=20.0,
)
