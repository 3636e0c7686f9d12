"""Starts the sensors and the mission, and judges when it is over."""

from firmware_drivers.compass import PERIODIC
from firmware_drivers.motors import STILL

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import Fault, Runaway

CHECK_EVERY = SECOND
"""Ns between two checks of the time a mission has taken."""
ENABLED_EVERY = SECOND // 10
"""Ns between two checks whether outputs are enabled, before the start."""
SOUND_FOR = SECOND // 5
"""Ns without a device that fails again, before the start; one that is being brought up fails less
often than one that is read."""
STOPS = 2
"""Both treads stop once when the radar sees the target, then turn, and once in front of it."""


class Mission(Atomic):
    """Wakes the sensors, gives the start signal, watches faults and the treads' commands.

    waking (0) --sonars! 1, compasses! periodic--> waiting (start_after)
    waiting, outputs enabled --> starting (0) --in1! 1--> watching
    waiting, outputs disabled --> waiting (a tenth of a second)
    waiting, a device failed twice in a row meanwhile --> waiting (a fifth of a second)
    watching (a second, again and again) --> watching
    watching, both treads stopped, turned and stopped, or --reached?--> ending (0) --ended!--> ended
    watching, `longest` spent with outputs enabled --> ending (0) --ended!, failed!--> ended
    watching, `faults` faults of one device in a row, a tread that turned unasked, or a
        contradiction --> ending (0)
    ending (0) --ended!, failed!--> ended

    Where obstacles are avoided the treads stop more often: then `reached` ends the mission, and
    stops are not counted.

    `failed` shuts the gate of every motor: see `Gate`. Time with outputs disabled does not
    count: a robot that is not armed yet gets nowhere.
    """

    def __init__(
        self,
        name: str,
        start_after: int,
        faults: int,
        longest: int,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(name)
        self.fault = self.in_port("fault", Fault)
        self.contradiction = self.in_port("contradiction", Fault)
        self.right = self.in_port("right", int)
        self.left = self.in_port("left", int)
        self.reached = self.in_port("reached", int)
        self.sonars = self.out_port("sonars", int)
        self.compasses = self.out_port("compasses", int)
        self.in1 = self.out_port("in1", float)
        self.failed = self.out_port("failed", Ending)
        self.ended = self.out_port("ended", Ending)
        self.start_after = start_after
        self.faults = faults
        self.longest = longest
        self.interlock = interlock
        self.counts_stops = True
        """True if the treads' second stop ends the mission; `reached` always does."""
        self.ending: Ending | None = None
        self._commands = [STILL, STILL]
        self._stops = 0
        self._spent = 0
        self._is_failing = False
        """A device has failed twice in a row since it was last looked."""

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
        elif self.ending is not None:
            self.ended.send(self.ending)
            if self.ending.failed:
                self.failed.send(self.ending)

    def internal(self) -> None:
        """Go on to the next phase."""
        if self.phase == "waking":
            self.hold_in("waiting", self.start_after)
        elif self.phase == "waiting":
            self._start_if_ready()
        elif self.phase == "ending":
            self.passivate("ended")
        else:
            self._watch_on()

    def external(self, elapsed: int) -> None:
        """Look at faults and commands; either may end the mission, once."""
        self._follow(self.right, self.left)
        if self.ending is None:
            self.ending = self._judge()
            if self.ending is not None:
                self.activate("ending")
                return
        self.continue_(elapsed)

    def _start_if_ready(self) -> None:
        """Start the controller once what it needs works, and what it commands can move.

        It says each thing once.
        """
        if self._is_failing:
            self._is_failing = False
            self.hold_in("waiting", SOUND_FOR)
        elif self.interlock():
            self.activate("starting")
        else:
            self.hold_in("waiting", ENABLED_EVERY)

    def _watch_on(self) -> None:
        """Look at the time once a second; longer than `longest` no mission takes."""
        if self.phase == "watching" and self.interlock():
            self._spent += CHECK_EVERY
        if self._spent >= self.longest:
            reason = f"the target was not reached within {self.longest / SECOND:g} s"
            self.ending = Ending(reason, failed=True)
            self.activate("ending")
        else:
            self.hold_in("watching", CHECK_EVERY)

    def _follow(self, *commands: InPort[int]) -> None:
        """Count how often both treads came to a stop.

        They turn against each other only after the first one, 50 ms later: over a link that is
        slower than that the stop may never arrive, since the newest command takes its place.
        """
        was_moving = any(self._commands)
        for number, port in enumerate(commands):
            if port:
                self._commands[number] = port[-1]
        self._stops += was_moving and not any(self._commands)
        if all(self._commands) and len(set(self._commands)) > 1:
            self._stops = max(self._stops, 1)

    def _judge(self) -> Ending | None:
        for fault in self.fault:
            self._is_failing |= fault.consecutive > 1
            if fault.consecutive >= self.faults or fault.kind == Runaway.__name__:
                return Ending(fault.reason, failed=True)
        if self.contradiction:
            return Ending(self.contradiction[-1].reason, failed=True)
        if self.reached or (self.counts_stops and self._stops == STOPS):
            return Ending("the target was reached", failed=False)
        return None


class Gate(Atomic):
    """Passes motor commands on until the mission failed; then it stops the motor and stays shut.

    open --command?--> passing (0) --passed!--> open
    any --failed?--> passing (0) --passed! 0--> shut
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.command = self.in_port("command", int)
        self.failed = self.in_port("failed", Ending)
        self.passed = self.out_port("passed", int)
        self.is_shut = False
        self.signal = STILL

    def output(self) -> None:
        """Pass the command on."""
        self.passed.send(self.signal)

    def internal(self) -> None:
        """Wait for the next."""
        self.passivate("shut" if self.is_shut else "open")

    def external(self, elapsed: int) -> None:
        """Take the newest command, or the failure."""
        if self.failed:
            self.is_shut = True
            self.signal = STILL
            self.activate("passing")
        elif self.is_shut:
            self.continue_(elapsed)
        else:
            self.signal = self.command[-1]
            self.activate("passing")
