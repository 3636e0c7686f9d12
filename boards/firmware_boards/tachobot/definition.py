"""Definition of the board: its schema, its faults, its bus load, and the robot itself."""

from typing import Final

from firmware_drivers.chips.mpu9250_burst import NINE_AXES
from firmware_drivers.chips.pca9685_registers import actual_cycle_us, duty_burst, prescale_for
from firmware_drivers.thrust_pairs import MOTORS

from firmware_boards.tachobot.controller import Controller
from firmware_boards.tachobot.experiments import EXPERIMENTS
from firmware_boards.tachobot.result import result_text, yaw_result
from firmware_boards.tachobot.settings import EscSettings, TachobotSettings
from firmware_boards.tachobot.wiring import Tachobot, chip_settings, control_period
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.experiments import PidLoop, Plant, Signal
from firmware_runtime.board.faults import Device, Recurring, bus_loads, device_faults, setting_fault
from firmware_runtime.board.robot import Ending, Lines, Robot
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.hal.budget import BusLoad


def _lever_arm(settings: TachobotSettings) -> float:
    return settings.world.lever_arm_m


YAW: Final = Plant(
    title="yaw on the platform",
    structure="rotation",
    input=Signal(
        ("controller.forces",),
        {"f1": 1.0, "f2": -1.0, "f3": 1.0, "f4": -1.0},
        scale=_lever_arm,
    ),
    output=Signal(("imu.sample",), {"rate.2": 1.0}),
    measures="rate",
    lag_s=lambda settings: settings.world.motor_lag_s,
    loop=PidLoop(
        kp="controller.yaw.kp",
        ki="controller.yaw.ki",
        kd="controller.yaw.kd",
        gain=lambda settings: 2.0 * settings.world.lever_arm_m,
        limit=lambda settings: 2.0 * settings.pair_thrust_n,
        period_s=lambda settings: settings.controller.period_s,
        delay_s=lambda settings: settings.controller.yaw.delay_s,
    ),
    stated={
        "inertia_kg_m2": lambda settings: settings.world.yaw_inertia_kg_m2,
        "damping_nms": lambda settings: settings.world.yaw_damping_nms,
        "coulomb_friction_nm": lambda settings: settings.world.coulomb_friction_nm,
        "static_friction_nm": lambda settings: settings.world.static_friction_nm,
        # From the forces that leave the controller to the sample that shows what they did.
        "delay_s": lambda settings: settings.controller.period_s,
    },
)


def faults(settings: TachobotSettings) -> list[str]:
    """Everything wrong that no single value shows, each with its key."""
    thrust = settings.thrust_pairs
    return [
        *device_faults(devices(settings), settings.buses),
        *(f"imu.{fault}" for fault in chip_settings(settings).faults()),
        *setting_fault(
            "thrust_pairs.frequency_hz", lambda: prescale_for(thrust.frequency_hz, thrust.osc_hz)
        ),
        *_esc_faults(settings),
        *_rate_faults(settings),
        *_friction_faults(settings),
        *_track_faults(settings),
    ]


def loads(settings: TachobotSettings) -> dict[str, BusLoad]:
    """Return the load of each bus by control ticks, without polls of a PCA9685 once a second."""
    imu, thrust, period = settings.imu, settings.thrust_pairs, control_period(settings)
    recurring = (
        Recurring(imu.bus, "imu sample", (NINE_AXES,), period),
        Recurring(thrust.bus, "thrust_pairs duties", (duty_burst(MOTORS),), period),
    )
    return bus_loads(settings.buses, recurring)


def build(settings: TachobotSettings, lines: Lines) -> Robot:
    """The robot on these buses; nothing is sent yet."""
    model = Tachobot(settings, lines)
    pwm = model.pwm_chips
    return Robot(
        model=model,
        # Every PCA9685 leaves the ALLCALL address before anything else is said on the bus.
        probe=(
            *(chip.silence for chip in pwm),
            *(chip.identify for chip in pwm),
            model.imu_chip.identify,
        ),
        stop=tuple(chip.stop_all for chip in pwm),
        still_on=tuple(chip.still_on for chip in pwm),
        result=lambda: _result(model),
        result_from=("controller",),
        ended=_ended(model),
        ends_on_failure=True,
        retune=model.retune,
        warnings=model.imu_chip.warnings,
    )


def devices(settings: TachobotSettings) -> tuple[Device, ...]:
    """Every chip that something is coupled to, each on its bus."""
    imu, thrust, esc = settings.imu, settings.thrust_pairs, settings.esc_in_use
    always = (
        Device("imu", "MPU-9250", imu.bus, imu.address),
        Device("thrust_pairs", "PCA9685", thrust.bus, thrust.address),
    )
    return always if esc is None else (*always, Device("esc", "PCA9685", esc.bus, esc.address))


def _esc_faults(settings: TachobotSettings) -> list[str]:
    """Return the faults of the speed controller, in the modes that lift with it."""
    mode = settings.controller.mode
    if mode != "platform" and settings.esc is None:
        missing = f"esc: missing; controller.mode {mode!r} lifts with it, expected a table [esc]"
        return [f"{missing} with its bus and address"]
    if (esc := settings.esc_in_use) is None:
        return []
    rate = setting_fault("esc.frequency_hz", lambda: prescale_for(esc.frequency_hz, esc.osc_hz))
    return rate or _pulse_faults(esc)


def _pulse_faults(esc: EscSettings) -> list[str]:
    cycle_us = actual_cycle_us(esc.frequency_hz, esc.osc_hz)
    sentence = (
        f"esc.high_pulse_us: {esc.high_pulse_us} us, expected more than low_pulse_us "
        f"({esc.low_pulse_us} us) and less than a cycle ({cycle_us:.0f} us)"
    )
    return [] if esc.low_pulse_us < esc.high_pulse_us < cycle_us else [sentence]


def _rate_faults(settings: TachobotSettings) -> list[str]:
    period_s, timeout_s = settings.controller.period_s, settings.thrust_pairs.timeout_s
    faults: list[str] = []
    if settings.imu.sample_hz * period_s <= 1:
        faults.append(
            f"imu.sample_hz: {settings.imu.sample_hz} Hz, expected more than the control rate "
            f"({1 / period_s:g} Hz), or ticks would find no new sample"
        )
    if timeout_s < 2 * period_s:
        faults.append(
            f"thrust_pairs.timeout_s: {timeout_s} s, expected two control periods "
            f"({2 * period_s:g} s) or more"
        )
    return faults


def _friction_faults(settings: TachobotSettings) -> list[str]:
    world = settings.world
    sentence = (
        f"world.static_friction_nm: {world.static_friction_nm} N m, expected at least "
        f"world.coulomb_friction_nm ({world.coulomb_friction_nm} N m)"
    )
    return [] if world.static_friction_nm >= world.coulomb_friction_nm else [sentence]


def _track_faults(settings: TachobotSettings) -> list[str]:
    """Return the faults of the tables of mode `track`, in that mode."""
    if settings.controller.mode != "track":
        return []
    from firmware_boards.tachobot.course import course_faults  # noqa: PLC0415 -- mode track

    yaw = settings.controller.yaw
    given = {"smith": yaw.smith, "wave": yaw.wave}
    return [
        *settings.position.faults(),
        *settings.world.position.faults(),
        *course_faults(settings),
        *(
            f"controller.yaw.{key}: has no effect; controller.mode is 'track'"
            for key, table in given.items()
            if table is not None
        ),
    ]


def _result(model: Tachobot) -> dict[str, object]:
    """Return the end by what the robot itself knows."""
    controller = model.controller
    if isinstance(controller, Controller):
        return yaw_result(controller.yaw.reference, controller.attitude.motion)
    from firmware_boards.tachobot.track_result import own_track_result  # noqa: PLC0415 -- mode track

    return own_track_result(controller)


def _ended(model: Tachobot) -> OutPort[Ending] | None:
    """Return the port by which it gives up: without a position, or without a yaw."""
    controller = model.controller
    if isinstance(controller, Controller):
        return controller.attitude.ended
    return controller.given_up.ended


BOARD = BoardDefinition(
    settings=TachobotSettings,
    build=build,
    devices=devices,
    loads=loads,
    faults=faults,
    retunable={
        "controller": (
            "controller.*.kp",
            "controller.*.ki",
            "controller.*.kd",
            "controller.*.anti_windup",
        ),
        "thrust_pairs": ("thrust_pairs.slew_per_s", "thrust_pairs.timeout_s"),
    },
    optional_components=("esc", "lift", "position_input"),  # where it hovers
    inputs={
        "yaw_reference": "hold",
        # each of these has a timeout of its own, in the model that takes it
        **dict.fromkeys(("x_position", "y_position", "position", "pose"), "hold"),
    },
    doubles_run_s=10.0,
    result_text=result_text,
    experiments=EXPERIMENTS,
    plant=YAW,
)
