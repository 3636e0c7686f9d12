"""The winch's motor: what drives it and what switches it off, beside what the table gave."""

from firmware_drivers.chips.step import Step

from firmware_runtime.hal.i2c import Message
from underwater.winch.driver import CONTROL, POWER, Winch

ON, OFF = 1, 0
COMMAND: tuple[tuple[Message, ...], ...] = (
    (bytes((POWER.address, 0)),),
    (bytes((CONTROL.address, ON)),),
)
"""Transactions of one command, for the bus-time budget."""


class WinchMotor(Winch):
    """The chip as an actuator: take the steps of `bring_up`, then drive it."""

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready: switched off before anything else is written."""
        identify, *writes = super().bring_up()
        return (identify, Step("switch off", self.stop, 0), *writes)

    def drive(self, power: float) -> None:
        """Pull with a share of full voltage, -1 to 1: two transactions, the brake is lifted last.

        A chip that was reset acknowledges it too, with another limit: `verify` finds out.
        """
        self.write(POWER, round(power * 127) & 0xFF)
        self.write(CONTROL, ON)

    def stop(self) -> None:
        """Switch the motor off and put the brake on: one transaction, right in any state."""
        self.write(CONTROL, OFF)

    def still_on(self) -> str | None:
        """Read back whether the motor is on, in a sentence; None if it is off."""
        return f"{self.place}: the motor is on" if self.read(CONTROL) & ON else None
