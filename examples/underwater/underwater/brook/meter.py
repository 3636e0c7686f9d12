"""The Brook as a hardware atomic model: the flow every period."""

from firmware_drivers.hardware import HardwareModel

from firmware_runtime import HalError
from underwater.brook.driver import ANSWER_NS, Brook


class Meter(HardwareModel):
    """Asks every `period` ns, and sends the `flow`, in l/s.

    bring_up --> resting (0) --> asking (ANSWER_NS) --> reporting (0)
    reporting --flow!, or fault!--> resting (what is left of the period) --> asking
    """

    def __init__(self, name: str, chip: Brook, period: int) -> None:
        super().__init__(name, chip.bring_up, chip.line)
        self.flow_out = self.out_port("flow", float)
        self.chip = chip
        self.period = period
        self.flow_l_s: float | None = None
        self._asked_for = 0

    def begin(self) -> None:
        """Ask at once."""
        self.hold_in("resting", 0)

    def output(self) -> None:
        """Send the flow, or what went wrong."""
        super().output()
        if self.flow_l_s is not None:
            self.flow_out.send(self.flow_l_s)

    def proceed(self) -> None:
        """Do what is due; a HalError is a fault, and there is no flow in this period."""
        self.flow_l_s = None
        if self.phase == "reporting":
            self.hold_in("resting", max(0, self.period - self._asked_for))
            return
        is_asking = self.phase == "asking"
        self._asked_for = self.sigma if is_asking else 0
        try:
            if is_asking:
                self.flow_l_s = self.chip.read_flow_l_s()
            else:
                self.chip.ask_flow()
        except HalError as error:
            self.note(error)
            self.activate("reporting")
            return
        if is_asking:
            self.consecutive_faults = 0
            self.activate("reporting")
        else:
            self.hold_after_transfer("asking", ANSWER_NS)
