"""Starts the sensors and the mission, and ends it when hardware fails."""

from drivers.compass import PERIODIC
from drivers.fault import Fault
from drivers.motors import STILL
from firmware_runtime.devs.atomic import Atomic


class Mission(Atomic):
    """Wakes the sensors, gives the start signal, and watches for faults.

    waking (0) --sensors! 1, compasses! periodic--> starting (start_after) --in1! 1--> watching
    watching, `faults` faults of one device in a row --> failing (0) --failed!, stop! 0--> failed

    `failed` carries the reason. From then on the gate of every motor is shut: see `Gate`.
    """

    def __init__(self, name: str, start_after: int, faults: int) -> None:
        super().__init__(name)
        self.fault = self.in_port("fault", Fault)
        self.sonars = self.out_port("sonars", int)
        self.compasses = self.out_port("compasses", int)
        self.in1 = self.out_port("in1", float)
        self.failed_out = self.out_port("failed", str)
        self.start_after = start_after
        self.faults = faults
        self.reason = ""

    def initialize(self) -> None:
        """Wake the sensors at once."""
        self.activate("waking")

    def output(self) -> None:
        """Send what the phase is for."""
        if self.phase == "waking":
            self.sonars.send(1)
            self.compasses.send(PERIODIC)
        elif self.phase == "starting":
            self.in1.send(1.0)
        elif self.phase == "failing":
            self.failed_out.send(self.reason)

    def internal(self) -> None:
        """Go on to the next phase."""
        if self.phase == "waking":
            self.hold_in("starting", self.start_after)
        else:
            self.passivate("failed" if self.phase == "failing" else "watching")

    def external(self, elapsed: int) -> None:
        """Look at the faults; a device that failed often enough ends the mission."""
        failures = [fault for fault in self.fault if fault.consecutive >= self.faults]
        if failures and not self.reason:
            self.reason = failures[0].reason
            self.activate("failing")
        else:
            self.continue_(elapsed)


class Gate(Atomic):
    """Passes motor orders on until the mission failed; then it stops the motor and stays shut.

    open --order?--> passing (0) --passed!--> open
    any --failed?--> passing (0) --passed! 0--> shut
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.order = self.in_port("order", int)
        self.failed = self.in_port("failed", str)
        self.passed = self.out_port("passed", int)
        self.is_shut = False
        self.signal = STILL

    def output(self) -> None:
        """Pass the order on."""
        self.passed.send(self.signal)

    def internal(self) -> None:
        """Wait for the next."""
        self.passivate("shut" if self.is_shut else "open")

    def external(self, elapsed: int) -> None:
        """Take the newest order, or the failure."""
        if self.failed:
            self.is_shut = True
            self.signal = STILL
            self.activate("passing")
        elif self.is_shut:
            self.continue_(elapsed)
        else:
            self.signal = self.order[-1]
            self.activate("passing")
