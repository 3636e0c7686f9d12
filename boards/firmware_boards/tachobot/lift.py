"""Starts the central propeller: arm it, and lift once it is armed."""

from firmware_runtime.devs.atomic import Atomic


class Lift(Atomic):
    """Asks for arming at the start of the run and for the lifting throttle afterwards.

    asking (0) --arm! true--> waiting --armed? true--> lifting (0) --throttle!--> waiting
    """

    def __init__(self, name: str, throttle: float) -> None:
        super().__init__(name)
        self.armed = self.in_port("armed", bool)
        self.arm = self.out_port("arm", bool)
        self.throttle_out = self.out_port("throttle", float)
        self.throttle = throttle

    def initialize(self) -> None:
        """Ask for arming at once."""
        self.activate("asking")

    def output(self) -> None:
        """Send what the phase is for."""
        if self.phase == "asking":
            self.arm.send(True)
        else:
            self.throttle_out.send(self.throttle)

    def internal(self) -> None:
        """Wait for the speed controller's answer."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Lift when armed; a disarmed speed controller is left alone, a fault has a cause."""
        if self.armed and self.armed[-1]:
            self.activate("lifting")
        else:
            self.continue_(elapsed)
