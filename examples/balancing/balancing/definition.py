"""What the runtime asks of a board: its schema, its faults, its bus load, and the robot itself."""

from firmware_drivers import dc_motor
from firmware_drivers.chips.mpu9250_burst import NINE_AXES
from firmware_drivers.chips.pca9685_registers import prescale_for

from balancing.result import result, result_text
from balancing.settings import BalancingSettings
from balancing.wiring import Balancing, chip_settings
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.experiments import StepExperiment
from firmware_runtime.board.faults import Device, Recurring, bus_loads, device_faults, setting_fault
from firmware_runtime.board.robot import Lines, Robot, absent_lines
from firmware_runtime.devs.time import seconds
from firmware_runtime.hal.budget import BusLoad


def devices(settings: BalancingSettings) -> tuple[Device, ...]:
    """Every chip, with its table, bus and address."""
    return (
        Device("imu", "MPU-9250", settings.imu.bus, settings.imu.address),
        Device("wheels", "PCA9685", settings.wheels.bus, settings.wheels.address),
    )


def faults(settings: BalancingSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    wheels = settings.wheels
    found = [
        *device_faults(devices(settings), settings.buses),
        *(f"imu.{fault}" for fault in chip_settings(settings).faults()),
        *setting_fault(
            "wheels.frequency_hz", lambda: prescale_for(wheels.frequency_hz, wheels.osc_hz)
        ),
        *_shared_channels(settings),
        *_rate_faults(settings),
    ]
    # Chips and models judge the rest; they can only be built on buses that are there.
    absent = absent_lines(settings.buses)
    return found or setting_fault("settings", lambda: Balancing(settings, absent))


def loads(settings: BalancingSettings) -> dict[str, BusLoad]:
    """What every control tick costs on each bus: a sample, and a command to each wheel."""
    period, wheels = seconds(settings.controller.period_s), settings.wheels
    recurring = (
        Recurring(settings.imu.bus, "imu sample", (NINE_AXES,), period),
        Recurring(wheels.bus, "left drive", dc_motor.TRAFFIC, period),
        Recurring(wheels.bus, "right drive", dc_motor.TRAFFIC, period),
    )
    return bus_loads(settings.buses, recurring)


def build(settings: BalancingSettings, lines: Lines) -> Robot:
    """The robot on these buses; nothing is sent yet."""
    model = Balancing(settings, lines)
    return Robot(
        model=model,
        # The PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(model.pwm_chip.silence, model.pwm_chip.identify, model.imu_chip.identify),
        stop=(model.pwm_chip.stop_all,),
        still_on=(model.pwm_chip.still_on,),
        result=lambda: result(model.controller.tilt.motion, None),
        result_from=("controller",),
        ended=None,
        ends_on_failure=True,
        retune=lambda changed: model.controller.retune(changed.controller),
        warnings=model.imu_chip.warnings,
    )


def _shared_channels(settings: BalancingSettings) -> list[str]:
    left, right = settings.wheels.left, settings.wheels.right
    shared = {left.pwm_channel, left.in1, left.in2} & {right.pwm_channel, right.in1, right.in2}
    return [
        f"wheels.right: channel {channel} is wheels.left's already; expected one of its own"
        for channel in sorted(shared)
    ]


def _rate_faults(settings: BalancingSettings) -> list[str]:
    period_s, sample_hz = settings.controller.period_s, settings.imu.sample_hz
    if sample_hz * period_s > 1:
        return []
    return [
        f"imu.sample_hz: {sample_hz} Hz, expected more than the control rate ({1 / period_s:g} Hz)"
    ]


PLACE_STEP = StepExperiment(
    title="Step of the place to stand at",
    port="place",
    begin=0.0,
    end=0.3,
    quantity="place",
    unit="m",
    answer="world.place_m",
    beside={"Pitch, rad": "world.pitch_rad"},
    settings={"world.start_pitch_rad": 0.0},
    stages=("simulation", "embedded"),
    at_s=5.0,
    watched_s=15.0,
)
"""It first rolls back a little, to lean forward: the response of a system of non-minimum phase."""

BOARD = BoardDefinition(
    settings=BalancingSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    retunable={
        "controller": (
            "controller.kp",
            "controller.ki",
            "controller.kd",
            "controller.max_drive",
            "controller.lean_per_speed_rad",
            "controller.lean_per_place_rad_s",
        ),
    },
    inputs={"place": "hold"},
    doubles_run_s=10.0,
    result_text=result_text,
    experiments={"place-step": PLACE_STEP},
)
