"""What the runtime asks of a board: its schema, its faults, its bus load, and the robot itself."""

from drivers import dc_motor
from drivers.chips import srf08
from drivers.chips.pca9685 import prescale_for
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.faults import Device, address_clashes, setting_fault, unknown_buses
from firmware_runtime.board.lines import Lines
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.time import seconds
from firmware_runtime.hal.absent import AbsentBus
from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction

from robotname.result import result
from robotname.settings import RobotNameSettings
from robotname.wiring import RobotName


def devices(settings: RobotNameSettings) -> tuple[Device, ...]:
    """Every chip, with its table, bus and address."""
    return (
        Device("motor", "PCA9685", settings.motor.bus, settings.motor.address),
        Device("sonar", "SRF08", settings.sonar.bus, settings.sonar.address),
    )


def faults(settings: RobotNameSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    chips, motor = devices(settings), settings.motor
    found = [
        *unknown_buses(chips, settings.buses),
        *address_clashes(chips),
        *setting_fault(
            "motor.frequency_hz", lambda: prescale_for(motor.frequency_hz, motor.osc_hz)
        ),
    ]
    # Chips and models judge the rest; they can only be built on buses that are there.
    absent = Lines({name: AbsentBus(name) for name in settings.buses})
    return found or setting_fault("settings", lambda: RobotName(settings, absent))


def loads(settings: RobotNameSettings) -> dict[str, BusLoad]:
    """What recurs on each bus: the sonar's rangings, each followed by a command to the motor."""
    period = seconds(settings.sonar.period_s)
    asked: dict[str, list[PeriodicTransaction]] = {name: [] for name in settings.buses}
    for transaction in srf08.TRAFFIC:
        asked[settings.sonar.bus].append(PeriodicTransaction("sonar ranging", transaction, period))
    for transaction in dc_motor.TRAFFIC:
        asked[settings.motor.bus].append(PeriodicTransaction("motor drive", transaction, period))
    return {
        name: BusLoad(name, round(bus.speed_hz), asked[name], bus.overhead_ns)
        for name, bus in settings.buses.items()
    }


def build(settings: RobotNameSettings, lines: Lines) -> Robot:
    """The robot on these buses; nothing is sent yet."""
    model = RobotName(settings, lines)
    return Robot(
        model=model,
        # The PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(model.pwm_chip.silence, model.pwm_chip.identify, model.sonar_chip.identify),
        stop=(model.pwm_chip.stop_all,),
        still_on=(model.pwm_chip.still_on,),
        result=lambda: result(settings.controller, model.controller.tracker.motion),
        retune=lambda changed: model.controller.retune(changed.controller),
        shown=model.sonar.distance_out,
    )


BOARD = BoardDefinition(
    settings=RobotNameSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    retunable=("controller.kp", "controller.ki", "controller.kd", "controller.max_drive"),
    doubles_run_s=20.0,
)
