"""One H-bridge channel on three outputs of a PCA9685 (Toshiba TB6612FNG data sheet, Adafruit HAT).

Two inputs choose the direction, the third is the speed by PWM:

    IN1  IN2  PWM
     1    0   duty   forward
     0    1   duty   reverse
     1    1    1     brake: the motor is short-circuited
     0    0    1     coast: the motor is left alone
     0    0    0     off: safe, and the state after power-up

If the three outputs are neighbours, in whatever order, each change is one burst and the bridge sees
it at one instant; otherwise the PWM is off while the inputs change. The bridge has no timeout and a
PCA9685 none either: a motor turns on when writes stop. STBY is taken to be high.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.pca9685_registers import CHANNELS
from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError

HIGH: Final = 1.0
LOW: Final = 0.0


class Wires(NamedTuple):
    """The outputs of a PCA9685 that a bridge channel hangs on, such as 8, 9, 10: M1 of the HAT."""

    pwm: int
    in1: int
    in2: int


class HBridge:
    """One motor on a PCA9685, which may drive other things besides."""

    def __init__(self, chip: Pca9685, pwm_channel: int, in1: int, in2: int) -> None:
        self.chip = chip
        self.place = f"H-bridge on channels {pwm_channel}, {in1}, {in2} of {chip.place}"
        self.wires = Wires(pwm_channel, in1, in2)
        if len(set(self.wires)) != 3 or not all(0 <= wire < CHANNELS for wire in self.wires):
            raise SettingError("expected three different channels from 0 to 15", where=self.place)
        chip.users.add(self.place)
        self._is_one_burst = max(self.wires) - min(self.wires) == 2

    def bring_up(self, frequency_hz: float) -> tuple[Step, ...]:
        """Give the PCA9685's own steps; all its outputs are off afterwards."""
        return self.chip.bring_up(frequency_hz)

    def share_bring_up(self, frequency_hz: float) -> Iterator[Step]:
        """Give the steps where other models drive other outputs of the PCA9685."""
        return self.chip.share_bring_up(frequency_hz)

    def stop(self) -> None:
        """Turn the three outputs full-off one by one, PWM first: right in any state of the chip."""
        self.chip.stop(self.wires)

    def forward(self, duty: float) -> None:
        """Turn one way, at a share of full voltage from 0 to 1.

        One burst of 14 bytes, 0.32 ms at 400 kHz, on neighbouring channels.
        Raises ValueError for another duty, NotReady before bring-up, and the errors of the bus.
        """
        self._set(duty, HIGH, LOW)

    def reverse(self, duty: float) -> None:
        """Turn the other way; else as `forward`."""
        self._set(duty, LOW, HIGH)

    def drive(self, share: float) -> None:
        """Turn at a share of full voltage, -1 to 1: backward below 0; 0 brakes. As `forward`."""
        if share > 0.0:
            self.forward(share)
        elif share < 0.0:
            self.reverse(-share)
        else:
            self.brake()

    def brake(self) -> None:
        """Short-circuit the motor: it stops and resists being turned."""
        self._set(HIGH, HIGH, HIGH)

    def coast(self) -> None:
        """Leave the motor alone: it runs down."""
        self._set(HIGH, LOW, LOW)

    def off(self) -> None:
        """Turn the three outputs full-off."""
        self._set(LOW, LOW, LOW)

    def _set(self, pwm: float, in1: float, in2: float) -> None:
        levels = dict(zip(self.wires, (pwm, in1, in2), strict=True))
        if self._is_one_burst:
            self.chip.set_duties(min(levels), [levels[channel] for channel in sorted(levels)])
            return
        self.chip.set_duties(self.wires.pwm, (LOW,))
        for channel in (self.wires.in1, self.wires.in2, self.wires.pwm):
            self.chip.set_duties(channel, (levels[channel],))
