"""Base of motor models: the newest command is kept, and written again after a failure.

A chip that loses its supply, or a bus that fails for a moment, must not leave a vehicle standing
where no further command would come: the command is written again once the chip is up. A chip that
fails again and again is given up; then only a new command is obeyed.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterable

from firmware_drivers.actuator import Actuator
from firmware_drivers.chips.step import Step
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.hal.budget import Line
from firmware_runtime.hal.interlock import Interlock, always_enabled, poll_period
from firmware_runtime.hal.wire_errors import HalError, NotReady
from firmware_runtime.models.motion import Applied

CLOCKWISE, COUNTERCLOCKWISE, STILL = 1, 2, 0
"""Motor signals, as in the detective robot's paper."""
FAULTS_BEFORE_FORGETTING = 10
"""Faults in a row after which a command is not written again."""


class Motors(Actuator):
    """Writes the newest command, again every `refresh`, and stops when there is none to trust.

    still, driving --command?--> obeying (0), written --> reporting (0) --> driving, or still
    driving (refresh) --> written again --> reporting (0) --> driving
    a command refused, or none for command_timeout --> stopped --> reporting (0) --fault!--> still
    the chip silent, or reset --> stopped --> reporting (0) --fault!--> bring_up --> obeying (0)
    obeying, driving with outputs disabled --> stopped --> reporting (0) --> disabled
    disabled, then enabled --> obeying (0)
    still (watch_every) --> looked after: still, or what a write leads to

    While driving, the interlock is polled every POLL_PERIOD: outputs that are disabled in between
    are off, and the command has to be written again.

    The other phases are those of `Actuator`. A refusal forgets the command, and so do
    FAULTS_BEFORE_FORGETTING faults in a row. Once a command has failed, faults are in a row until
    the chip has taken two commands one after the other, and what drives has done as told. A command
    that comes while the chip is not up, not stopped yet, or while the interlock disables outputs,
    is kept, and not obeyed once it is older than command_timeout, unless it is one that holds until
    the next (`keeps_commands`); one that is none is reported meanwhile.
    """

    keeps_commands = False
    """Whether a command is an event that holds until the next one, as it is for a head that sweeps:
    time in which it could not be obeyed is then not counted."""

    def __init__(  # noqa: PLR0913 -- chip and line, then how it is driven
        self,
        name: str,
        bring_up: Callable[[], Iterable[Step]],
        line: Line,
        *,
        refresh: int = NEVER,
        command_timeout: int = NEVER,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(name, bring_up, line, interlock)
        self.refresh = refresh
        self.command_timeout = command_timeout
        self.watch_every = NEVER
        """Ns until motors that stand are looked after again; a subclass that can sets it."""
        self._has_command = False
        self._refusal: NotReady | None = None
        self._since_command = 0
        """Ns since the newest command came, whatever was done with it."""
        self._since_refresh = 0
        self._is_repeated = False
        self._has_taken_command = False
        self._is_doubtful = False
        self._faults_in_a_row = 0

    # What a subclass knows ------------------------------------------------------------------------

    @abstractmethod
    def take_command(self) -> None:
        """Read the ports. Raises NotReady for what is no command; that stops the motors."""

    @abstractmethod
    def forget_command(self) -> None:
        """Make standing still the command."""

    @abstractmethod
    def is_moving(self) -> bool:
        """Return whether the command is something else than standing still."""

    @abstractmethod
    def write_command(self) -> None:
        """Write the command to the chip. Raises HalError."""

    def written_of_command(self) -> Applied:
        """Return the part of the command that was written: all, where nothing limits it."""
        return Applied.ALL

    def look_after(self) -> None:
        """See whether motors that are to stand do so; most chips say nothing of it."""
        self.settle()

    def wait_until_enabled(self) -> None:
        """Stop as outputs are disabled; the command is obeyed once they are enabled again."""
        self._has_command = True
        self.disable()

    # The DEVS functions -------------------------------------------------------------------------

    def begin(self) -> None:
        """Obey the command that failed, or a newer one; else stand still."""
        if not self._is_doubtful:
            self._faults_in_a_row = 0
        elif self._is_repeated and self._faults_in_a_row >= FAULTS_BEFORE_FORGETTING:
            self._is_repeated = self._has_command = False
            self.forget_command()
        super().begin()

    def internal(self) -> None:
        """Go on, with a command that is older now."""
        self._since_command += self.sigma
        super().internal()

    def external(self, elapsed: int) -> None:
        """Take the command; it is written next, unless the chip is not up or not stopped."""
        try:
            self.take_command()
        except NotReady as error:
            self._refusal = error
        self._has_command = True
        self._since_command = 0
        self._is_repeated = False
        if self.phase in {"still", "driving"}:
            self.activate("obeying")
        elif self.phase == "disabled" and self._refusal is not None:
            self.report_refused(self._refusal, elapsed)
            self._refusal = None
            self.forget_command()
        else:
            self.continue_(elapsed)

    def settle(self) -> None:
        """Obey a command not written yet; else drive on, or stand still."""
        if self._has_command:
            self.activate("obeying")
        elif self.is_moving():
            self.hold_in("driving", self._until_due())
        else:
            self.hold_in("still", self.watch_every)

    def drive_on(self) -> None:
        """Write what is due: a new command or the same again; with outputs disabled, a stop."""
        if self.phase == "still":
            self.look_after()
        elif not self.interlock():
            if self._refusal is not None:
                self._forget(self._refusal)
            self.wait_until_enabled()
        elif self.phase == "driving":
            self._refresh()
        else:
            self._obey()

    def resume(self) -> None:
        """Obey the command kept meanwhile."""
        self._obey()

    def note(self, error: FirmwareRuntimeError) -> None:
        """Keep a fault for the next output; one that follows a bring-up is still in a row."""
        super().note(error)
        self._has_taken_command = False
        self._faults_in_a_row += 1
        self.faults[-1] = self.faults[-1]._replace(consecutive=self._faults_in_a_row)

    def lost_settings(self, error: HalError) -> bool:  # noqa: ARG002 -- whatever the error was
        """Bring the chip up after every error, and then write the command again."""
        return True

    def fail(self, error: HalError) -> None:
        """Stop, bring the chip up, then write the same again."""
        super().fail(error)
        self._has_command = self._is_repeated = self._is_doubtful = True

    def has_acted(self) -> bool:
        """Return whether what drives has done as told since it did not, as far as it is known."""
        return True

    # ---------------------------------------------------------------------------------------------

    def _obey(self) -> None:
        if self.keeps_commands and not self._is_repeated:
            self._since_command = 0
        self._has_command = self._is_repeated = False
        self._since_refresh = 0
        if (why := self._refusal or self._too_old()) is not None:
            self._refuse(why)
        else:
            self.write_and_report()

    def _refresh(self) -> None:
        self._since_refresh += self.sigma
        if (why := self._too_old()) is not None:
            self._refuse(why)
        elif self._since_refresh >= self.refresh:
            self.write_and_report()
        else:
            self.settle()

    def write_and_report(self) -> None:
        """Write the command, or fail; either is reported."""
        self._since_refresh = 0
        try:
            self.write_command()
        except HalError as error:
            self.fail(error)
            return
        self.note_success(self.written_of_command())
        if self._has_taken_command and self.has_acted():
            self._is_doubtful = False
            self._faults_in_a_row = 0
        self._has_taken_command = True
        self.activate("reporting")

    def _too_old(self) -> NotReady | None:
        if not (self.is_moving() and self._since_command >= self.command_timeout):
            return None
        seconds = self.command_timeout / SECOND
        return NotReady(f"no command for {seconds:g} s; stopped", where=self.path)

    def _refuse(self, error: HalError) -> None:
        self._forget(error)
        self.stop()

    def _forget(self, error: HalError) -> None:
        """Forget the command, and note why."""
        self.note(error)
        self._refusal = None
        self.forget_command()

    def _until_due(self) -> int:
        """Ns until a write, the end of the command's time, or a poll of the interlock is due."""
        due = poll_period(self.interlock)
        if self.refresh != NEVER:
            due = min(due, self.refresh - self._since_refresh)
        if self.command_timeout != NEVER:
            due = min(due, self.command_timeout - self._since_command)
        return due
