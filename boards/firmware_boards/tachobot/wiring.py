"""TachoBot's schematic: which chip hangs on which bus, and which wire leads where."""

from typing import TYPE_CHECKING, Final

from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.gyro_bias import GyroBias
from firmware_drivers.imu import Imu
from firmware_drivers.thrust_pairs import ThrustPairs, ThrustSettings

from firmware_boards.tachobot.controller import Controller
from firmware_boards.tachobot.settings import EscSettings, TachobotSettings, TrackSettings
from firmware_runtime.board.robot import Lines
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.motion import Motion

if TYPE_CHECKING:
    from firmware_drivers.esc import EscSettings as EscModelSettings

    from firmware_boards.tachobot.tracking import TrackingController


UNSTEERED: Final = 2 * SECOND
"""Ns for which the thrust pairs may be out of reach while it hovers."""


class Lift(Atomic):
    """Asks for arming at the start of the run and for the lifting throttle afterwards.

    asking (0) --arm! true--> waiting --armed? true--> lifting (0) --throttle!--> waiting
    waiting --armed? false--> asking
    waiting, lifted --pairs_fault? again and again for UNSTEERED--> unsteered (0) --unsteered!-->
    waiting

    So a fault of the speed controller's chip is over when that answers again and was armed anew,
    as one of the thrust pairs is: its propeller stands for as long as arming takes. Pairs that
    nothing reaches may drive as they were told last, and it hovers without friction: it comes down.
    """

    def __init__(self, name: str, throttle: float) -> None:
        super().__init__(name)
        self.armed = self.in_port("armed", bool)
        self.arm = self.out_port("arm", bool)
        self.pairs_fault = self.in_port("pairs_fault", Fault)
        self.throttle_out = self.out_port("throttle", float)
        self.unsteered = self.out_port("unsteered", Fault)
        self.throttle = throttle
        self._is_lifted = False
        self._fault: Fault | None = None
        """The last one of those in a row."""
        self._failing_for = 0

    def initialize(self) -> None:
        """Ask for arming at once."""
        self.activate("asking")

    def output(self) -> None:
        """Send what the phase is for."""
        if self.phase == "asking":
            self.arm.send(True)
        elif self.phase == "unsteered" and self._fault is not None:
            why = f"the thrust pairs have been out of reach for {UNSTEERED // SECOND} s"
            self.unsteered.send(self._fault._replace(reason=f"{why}: {self._fault.reason}"))
        else:
            self.throttle_out.send(self.throttle)

    def internal(self) -> None:
        """Wait for the speed controller's answer."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Lift when armed, and have it armed again when it no longer is."""
        self._failing_for += elapsed
        if self.pairs_fault:
            self._fault = self.pairs_fault[-1]
            if any(fault.consecutive == 1 for fault in self.pairs_fault):
                self._failing_for = 0
        if self.armed:
            self._is_lifted = self.armed[-1]
            self.activate("lifting" if self._is_lifted else "asking")
        elif self.pairs_fault and self._is_lifted and self._failing_for >= UNSTEERED:
            self.activate("unsteered")
        else:
            self.continue_(elapsed)


class Tachobot(Coupled):
    """imu -> controller <-> thrust_pairs; hovering, the esc lifts, then enables the controller.

    Only what is coupled is there: on the platform no second PCA9685, whatever the file says.

    Chips are built here and not touched: the models bring them up, one step at a time.
    """

    def __init__(self, settings: TachobotSettings, lines: Lines) -> None:
        super().__init__("tachobot")
        buses, interlock = lines.buses, lines.interlock
        thrust, imu = settings.thrust_pairs, settings.imu
        self.thrust_chip = Pca9685(buses[thrust.bus], thrust.address, osc_hz=thrust.osc_hz)
        self.pwm_chips = [self.thrust_chip]
        """Every chip that drives something."""
        self.imu_chip = Mpu9250(buses[imu.bus], imu.address, chip_settings(settings))

        self.thrust_pairs = self.add(
            ThrustPairs("thrust_pairs", self.thrust_chip, thrust_settings(settings), interlock)
        )
        self.imu = self.add(
            Imu("imu", self.imu_chip, control_period(settings), gyro_bias(settings))
        )
        self.controller = self.add(_controller(settings))

        self.couple(self.imu.sample, self.controller.sample)
        self.couple(self.controller.forces, self.thrust_pairs.forces)
        self.couple(self.thrust_pairs.applied_out, self.controller.applied)
        if not isinstance(self.controller, Controller):
            self._couple_position(self.controller, seconds(settings.position.brake_after_s))
        else:
            self.yaw_reference = self.in_port("yaw_reference", float)
            self.couple(self.yaw_reference, self.controller.yaw_reference)
        if settings.esc_in_use is not None:
            self._add_lift(settings.esc_in_use, lines)

    def retune(self, settings: TachobotSettings) -> None:
        """Take up the gains and limits of new settings."""
        self.controller.retune(settings)
        self.thrust_pairs.settings = thrust_settings(settings)

    def _add_lift(self, settings: EscSettings, lines: Lines) -> None:
        """Arm the central propeller at the start; nothing else turns unless that lifts."""
        from firmware_drivers.esc import Esc  # noqa: PLC0415 -- where it hovers

        chip = Pca9685(lines.buses[settings.bus], settings.address, osc_hz=settings.osc_hz)
        self.pwm_chips.append(chip)
        esc = self.add(Esc("esc", chip, esc_settings(settings), lines.interlock))
        lift = self.add(Lift("lift", settings.throttle))

        self.couple(lift.arm, esc.arm)
        self.couple(esc.armed_out, lift.armed)
        self.couple(lift.throttle_out, esc.throttle)
        self.couple(self.thrust_pairs.fault_out, lift.pairs_fault)
        self.couple(lift.unsteered, self.controller.unsteered)
        self.couple(esc.armed_out, self.controller.enable)
        self.couple(esc.armed_out, self.thrust_pairs.enable)
        if isinstance(self.controller, Controller):
            self.x_position = self.in_port("x_position", Motion)
            self.y_position = self.in_port("y_position", Motion)
            self.couple(self.x_position, self.controller.x_position)
            self.couple(self.y_position, self.controller.y_position)

    def _couple_position(self, controller: "TrackingController", timeout: int) -> None:
        """The position, with yaw or without, comes from outside: no chip on board has it."""
        from firmware_boards.tachobot.position_input import PositionInput  # noqa: PLC0415 -- mode track
        from firmware_runtime.models.position_fix import (  # noqa: PLC0415 -- likewise
            PoseFix,
            PositionFix,
        )

        self.position = self.in_port("position", PositionFix)
        self.pose = self.in_port("pose", PoseFix)
        self.position_input = self.add(PositionInput("position_input", timeout))
        self.couple(self.position, self.position_input.position_in)
        self.couple(self.pose, self.position_input.pose_in)
        self.couple(self.position_input.position, controller.position)
        self.couple(self.position_input.pose, controller.pose)


def _controller(settings: TachobotSettings) -> "Controller | TrackingController":
    control = settings.controller
    if isinstance(control, TrackSettings):
        from firmware_boards.tachobot.tracking import TrackingController  # noqa: PLC0415 -- mode track

        return TrackingController("controller", settings, control)
    return Controller("controller", control, settings.pair_thrust_n, settings.yaw_plant)


def control_period(settings: TachobotSettings) -> int:
    """Ns from one tick of the controller to the next: the IMU's period drives everything."""
    return seconds(settings.controller.period_s)


def chip_settings(settings: TachobotSettings) -> Mpu9250Settings:
    """The IMU's registers as the board file wants them."""
    imu = settings.imu
    return Mpu9250Settings(
        sample_hz=imu.sample_hz,
        bandwidth_hz=imu.bandwidth_hz,
        accel_range_g=imu.accel_range_g,
        gyro_range_dps=imu.gyro_range_dps,
        mounting=imu.mounting,
        also_accept=imu.also_accept,
    )


def gyro_bias(settings: TachobotSettings) -> GyroBias:
    """Return the settings by which the gyro's bias is measured before control begins."""
    imu = settings.imu
    samples = max(2, round(imu.calibration_s / settings.controller.period_s))
    return GyroBias(samples, max_spread=imu.still_rad_s, max_bias=imu.max_bias_rad_s)


def thrust_settings(settings: TachobotSettings) -> ThrustSettings:
    """Return the thrust pairs' settings."""
    thrust = settings.thrust_pairs
    return ThrustSettings(
        pair_thrust_n=settings.pair_thrust_n,
        frequency_hz=thrust.frequency_hz,
        slew_per_s=thrust.slew_per_s,
        timeout=seconds(thrust.timeout_s),
        first_channel=thrust.first_channel,
    )


def esc_settings(esc: EscSettings) -> "EscModelSettings":
    """Return the speed controller's settings."""
    from firmware_drivers.esc import EscSettings as EscModelSettings  # noqa: PLC0415 -- as above

    return EscModelSettings(
        channel=esc.channel,
        frequency_hz=esc.frequency_hz,
        low_pulse_us=esc.low_pulse_us,
        high_pulse_us=esc.high_pulse_us,
        arming=seconds(esc.arming_s),
    )
