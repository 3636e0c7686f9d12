"""The winch's motor as a hardware atomic model: what drives it, how long, and how it stops."""

from firmware_drivers.actuator import Actuator

from firmware_runtime.hal.interlock import POLL_PERIOD, Interlock, always_enabled
from firmware_runtime.hal.wire_errors import HalError
from underwater.winch.motor import WinchMotor


class Haul(Actuator):
    """Obeys `power`, -1 to 1 of full voltage; 0 is off, with the brake on.

    off, driving --power?--> driving (POLL_PERIOD) --> the same, until the command is `timeout` old
    driving, power 0 --> stopped --> reporting (0) --> off
    driving, no command for `timeout`, or one that is none --> stopped --> reporting --fault!--> off
    driving, outputs disabled --> stopped --> reporting (0) --> disabled, then enabled --> off

    The other phases are those of `Actuator`. A command that comes while it cannot be obeyed is not
    kept: a controller's next one is fresher.
    """

    def __init__(
        self, name: str, chip: WinchMotor, timeout: int, interlock: Interlock = always_enabled
    ) -> None:
        super().__init__(name, chip.bring_up, chip.line, interlock)
        self.power_in = self.in_port("power", float)
        self.chip = chip
        self.timeout = timeout
        self._since_command = 0

    # What `Actuator` wants to know ----------------------------------------------------------------

    def write_stop(self) -> None:
        """Switch the motor off, whatever state the chip is in."""
        self.chip.stop()

    def settle(self) -> None:
        """Wait for a command, switched off."""
        self.passivate("off")

    def drive_on(self) -> None:
        """Go on while the interlock and the command hold; the winch would go on without us."""
        self._since_command += self.sigma
        self.since_poll += self.sigma
        if not self.interlock():
            self.disable()
        elif self._since_command >= self.timeout:
            silent = f"no command for {self.timeout / 1e9:g} s; stopped"
            self.fail(HalError(silent, where=self.path))
        else:
            self._stay()

    def poll(self) -> None:
        """Check that the chip was not reset: then it pulls with another limit."""
        self.chip.verify()

    # The DEVS function that is left ---------------------------------------------------------------

    def external(self, elapsed: int) -> None:
        """Obey the newest command, if this is the time for one."""
        power = self.power_in[-1]
        refused = HalError(f"{power}; stopped", where=self.power_in.path, expected="-1 to 1")
        is_refused = not -1.0 <= power <= 1.0  # so is no number at all
        if self.phase not in {"off", "driving"}:
            if is_refused:
                self.report_refused(refused, elapsed)
            else:
                self.continue_(elapsed)
            return
        if self.phase == "driving":
            self.since_poll += elapsed
        if is_refused:
            self.fail(refused)
        elif power == 0.0:
            self.stop()
        elif self.interlock():
            self._obey(power)
        else:
            self.disable()

    def _obey(self, power: float) -> None:
        self._since_command = 0
        try:
            self.chip.drive(power)
        except HalError as error:
            self.fail(error)
        else:
            self.note_success()
            self._stay()

    def _stay(self) -> None:
        try:
            self.poll_if_due()
        except HalError as error:
            self.fail(error)
        else:
            self.hold_applying("driving", POLL_PERIOD)
