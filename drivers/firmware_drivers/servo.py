"""Servos on one PCA9685 as a hardware atomic model: angles in rad become pulse lengths.

A servo turns to the angle that its pulse stands for and holds it with force while pulses come;
without them it is limp. It reports nothing: where it stands before the first command is not known,
so the first one turns it as fast as it can, and the slew limit counts from then on.

The model has its chip to itself: a stop turns all sixteen outputs full-off.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from firmware_drivers.chips.pca9685 import POLL, Pca9685
from firmware_drivers.chips.pca9685_registers import (
    CHANNELS,
    NOMINAL_OSC_HZ,
    actual_cycle_us,
    duty_burst,
)
from firmware_drivers.motors import Motors
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import NotReady
from firmware_runtime.models.motion import Applied

SLOWEST_HZ: Final = 24
FASTEST_HZ: Final = 400
"""Beyond it no pulse of 2.5 ms fits; digital servos go so far."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """One servo: where it is wired, and which pulses stand for which angles."""

    name: str
    """Also that of its port."""
    channel: int
    least_rad: float
    most_rad: float
    """Commands beyond these limits are cut to them."""
    least_pulse_us: float
    """Pulse at `least_rad`; longer than the other one where the servo is mounted upside down."""
    most_pulse_us: float
    """Pulse at `most_rad`."""
    slew_rad_s: float
    """Greatest rate of the commanded angle."""

    def pulse_us(self, angle_rad: float) -> float:
        """The pulse that stands for an angle."""
        share = (angle_rad - self.least_rad) / (self.most_rad - self.least_rad)
        return self.least_pulse_us + share * (self.most_pulse_us - self.least_pulse_us)

    def limited(self, angle_rad: float) -> float:
        """The nearest angle within the limits."""
        return max(self.least_rad, min(self.most_rad, angle_rad))

    def faults(self, cycle_us: float) -> list[str]:
        """List what cannot be in a PWM cycle of that length, a sentence each."""
        faults = []
        if not 0 <= self.channel < CHANNELS:
            faults.append(f"{self.name}.channel: {self.channel}, expected 0 to {CHANNELS - 1}")
        if not -math.inf < self.least_rad < self.most_rad < math.inf:
            faults.append(
                f"{self.name}.least_rad, most_rad: {self.least_rad}, {self.most_rad}, "
                "expected the second to be greater"
            )
        if not 0 < self.slew_rad_s < math.inf:
            faults.append(f"{self.name}.slew_rad_s: {self.slew_rad_s}, expected more than 0")
        pulses = {"least_pulse_us": self.least_pulse_us, "most_pulse_us": self.most_pulse_us}
        for key, pulse_us in pulses.items():
            if not 0 < pulse_us < cycle_us:
                faults.append(
                    f"{self.name}.{key}: {pulse_us}, expected more than 0 and less than a cycle, "
                    f"{cycle_us:.0f}"
                )
        return faults


@dataclass(frozen=True, slots=True, kw_only=True)
class ServosSettings:
    """The servos of one chip and what they share."""

    servos: Sequence[Servo]
    frequency_hz: float
    """Pulse rate, the whole chip's: 50 Hz for most servos."""
    period: int
    """Ns from one write to the next while servos are driven: the grain of the slew."""
    timeout: int = NEVER
    """Ns without a new command after which all servos go limp."""

    def faults(self, osc_hz: float = NOMINAL_OSC_HZ) -> list[str]:
        """List what cannot be, a sentence each; `osc_hz` is the chip's oscillator, as measured."""
        if not SLOWEST_HZ <= self.frequency_hz <= FASTEST_HZ:
            expected = f"expected {SLOWEST_HZ} to {FASTEST_HZ}"
            return [f"frequency_hz: {self.frequency_hz}, {expected}"]
        try:
            cycle_us = actual_cycle_us(self.frequency_hz, osc_hz)
        except SettingError as error:
            return [f"frequency_hz: {error}"]
        faults = [fault for each in self.servos for fault in each.faults(cycle_us)]
        for key in ("name", "channel"):
            values = [getattr(each, key) for each in self.servos]
            faults += [
                f"{key}: {value} is that of two servos"
                for value in dict.fromkeys(values)
                if values.count(value) > 1
            ]
        if not self.servos:
            faults.append("servos: none, expected one or more")
        for key, span in {"period": self.period, "timeout": self.timeout}.items():
            if span <= 0:
                faults.append(f"{key}: {span} ns, expected more than 0")
        return faults

    @property
    def traffic(self) -> tuple[tuple[Message, ...], ...]:
        """Transactions of one write of all servos, for the bus-time budget.

        There is one each `period` while servos are driven, and one more for each command.
        """
        return (*POLL, *(duty_burst(1) for _ in self.servos))


class Servos(Motors):
    """Turns each servo to the angle at the port of its name, in rad; `release` makes all limp.

    The phases are those of `Motors`: driven servos are written every `period`, on their way and
    when they are there. A servo that no command came for stays limp. After a fault, at a stop and
    at the end all outputs of the chip are full-off.
    """

    def __init__(
        self,
        name: str,
        chip: Pca9685,
        settings: ServosSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        faults = settings.faults(chip.osc_hz)
        if faults:
            raise SettingError(f"{name} on {chip.place}: {'; '.join(faults)}")
        chip.users.add(name, stops_all=True)
        super().__init__(
            name,
            lambda: chip.bring_up(settings.frequency_hz),
            chip.line,
            refresh=settings.period,
            command_timeout=settings.timeout,
            interlock=interlock,
        )
        self.angle = {each.name: self.in_port(each.name, float) for each in settings.servos}
        """The ports, by the servos' names."""
        self.release = self.in_port("release", bool)
        self.chip = chip
        self.settings = settings
        self.targets: dict[str, float] = {}
        """The angles last commanded, in rad, within the limits."""
        self.written: dict[str, float] = {}
        """The angles that pulses stand for now; a limp servo has none."""
        self._beyond: set[str] = set()
        """The servos whose command was cut to their limits."""
        self._since_write = 0

    def external(self, elapsed: int) -> None:
        """Take the command; the slew goes on from the last write."""
        self._since_write += elapsed
        super().external(elapsed)

    def drive_on(self) -> None:
        """Write what is due, as far as the slew allows by now."""
        self._since_write += self.sigma
        super().drive_on()

    def take_command(self) -> None:
        """Read the ports."""
        if self.release and self.release[-1]:
            self.targets.clear()
        for servo in self.settings.servos:
            if port := self.angle[servo.name]:
                if not math.isfinite(port[-1]):
                    raise NotReady(f"{port[-1]} rad, expected a number; all limp", where=port.path)
                self._take(servo, port[-1])

    def forget_command(self) -> None:
        """Command all servos to be limp."""
        self.targets.clear()

    def is_moving(self) -> bool:
        """Return whether any servo is driven; one that holds its angle is."""
        return bool(self.targets)

    def write_command(self) -> None:
        """Write each pulse, if the chip is as set: reset, it would pulse no more."""
        self.chip.poll()
        if not self.targets:
            self.write_stop()
        for servo in self.settings.servos:
            if servo.name in self.targets:
                angle_rad = self._next(servo)
                duty = servo.pulse_us(angle_rad) * 1e-6 * self.chip.frequency_hz
                self.chip.set_duties(servo.channel, (duty,))
                self.written[servo.name] = angle_rad
            elif self.written.pop(servo.name, None) is not None:  # released as another was told
                self.chip.set_duties(servo.channel, (0.0,))
        self._since_write = 0

    def written_of_command(self) -> Applied:
        """Part while a servo is on its way or at a limit; nothing while all are limp."""
        if not self.targets:
            return Applied.NOTHING
        is_whole = self.written == self.targets and self._beyond.isdisjoint(self.targets)
        return Applied.ALL if is_whole else Applied.PART

    def write_stop(self) -> None:
        """Turn all sixteen outputs of the chip full-off, right in any state of it."""
        self.written.clear()
        self.chip.stop_all()

    # ---------------------------------------------------------------------------------------------

    def _take(self, servo: Servo, angle_rad: float) -> None:
        target = self.targets[servo.name] = servo.limited(angle_rad)
        if target == angle_rad:
            self._beyond.discard(servo.name)
        else:
            self._beyond.add(servo.name)

    def _next(self, servo: Servo) -> float:
        """The angle to write now, on the way to the target."""
        target = self.targets[servo.name]
        here = self.written.get(servo.name, target)
        reach = servo.slew_rad_s * self._since_write / SECOND
        return max(here - reach, min(here + reach, target))
