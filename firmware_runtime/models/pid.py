"""PID controllers as atomic models: one for a reference, and one that follows a moving setpoint.

With a reference the derivative acts on the measured rate, not on the error: a step gives no kick.
With a setpoint it acts on the difference of the rates, and what the acceleration of the setpoint
takes is added before any error shows. The integral uses the time that really passed between
measurements, and follows what actuators apply (port `applied`, `models.motion`): while that is
nothing it stands still, so that time spent disarmed changes no later answer.
"""

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Applied, Motion, Setpoint


class PidGains(Struct, frozen=True):
    """Gains for a coordinate in m or rad and a command in N."""

    kp: float
    """N per unit of error."""
    ki: float
    """N per unit of error and second."""
    kd: float
    """N per unit of measured rate."""
    limit: float
    """The command is kept within plus and minus this many N."""
    anti_windup: bool = True
    """Freeze the integral while the command is at its limit, or applied in part, and the error
    pushes it further."""

    def winds_up(self, applied: Applied, wanted: float, error: float) -> bool:
        """Return whether the integral stands still, with a command that was to be `wanted`."""
        if applied is Applied.NOTHING:
            return True
        is_limited = applied is Applied.PART or not -self.limit < wanted < self.limit
        return is_limited and self.anti_windup and wanted * error > 0.0


class _PidBlock(Atomic):
    """Base of both controllers: the last measurement is answered at its own instant.

    waiting --measurement?--> commanding (0) --command_n!--> waiting
    """

    def __init__(self, name: str, gains: PidGains) -> None:
        super().__init__(name)
        self.measurement = self.in_port("measurement", Motion)
        self.command = self.out_port("command_n", float)
        self.gains = gains
        self.applied = Applied.ALL
        self.integral_n = 0.0
        self.command_n = 0.0
        self._since_measurement = 0

    def output(self) -> None:
        """Send the command."""
        self.command.send(self.command_n)

    def internal(self) -> None:
        """Wait for the next measurement."""
        self.passivate("waiting")


class Pid(_PidBlock):
    """Answers every measurement with a command, at the same instant.

    waiting --measurement?--> commanding (0) --command_n!--> waiting

    A new `reference` takes effect with the next measurement.
    Couple the actuator's `applied`: without it every command counts as applied.
    """

    def __init__(self, name: str, gains: PidGains, reference: float) -> None:
        super().__init__(name, gains)
        self.reference_in = self.in_port("reference", float)
        self.applied_in = self.in_port("applied", Applied)
        self.reference = reference
        self._has_measured = False

    def external(self, elapsed: int) -> None:
        """Take references and measurements in; the last of each counts."""
        self._since_measurement += elapsed
        if self.reference_in:
            self.reference = self.reference_in[-1]
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if not self.measurement:
            self.continue_(elapsed)
            return
        seconds = self._since_measurement / SECOND if self._has_measured else 0.0
        self.command_n = self._answer(self.measurement[-1], seconds)
        self._since_measurement = 0
        self._has_measured = True
        self.activate("commanding")

    def _answer(self, motion: Motion, seconds: float) -> float:
        """The command in N, `seconds` after the last one; updates the integral."""
        gains = self.gains
        position, rate = motion
        error = self.reference - position
        integral = self.integral_n + gains.ki * error * seconds
        wanted = gains.kp * error + integral - gains.kd * rate
        command, limit = wanted, gains.limit
        if not -limit < wanted < limit:
            command = max(-limit, min(limit, wanted))
        if not gains.winds_up(self.applied, wanted, error):
            self.integral_n = integral
        return command


class TrackingPid(_PidBlock):
    """Answers every measurement with a command, at the same instant, while it has a setpoint.

    waiting --measurement?--> commanding (0) --command_n!--> waiting

    `inertia` is the command in N that an acceleration of 1 m/s2 or rad/s2 takes. `kd` acts on the
    difference of the rates. A setpoint older than `timeout` ns is none. The integral follows
    `applied` as that of `Pid` does.
    """

    def __init__(self, name: str, gains: PidGains, inertia: float, timeout: int) -> None:
        super().__init__(name, gains)
        self.setpoint = self.in_port("setpoint", Setpoint)
        self.applied_in = self.in_port("applied", Applied)
        self.inertia = inertia
        self.timeout = timeout
        self._setpoint: Setpoint | None = None
        self._since_setpoint = 0

    def external(self, elapsed: int) -> None:
        """Take the newest setpoint and measurement in."""
        self._since_measurement += elapsed
        self._since_setpoint += elapsed
        if self.setpoint:
            self._setpoint, self._since_setpoint = self.setpoint[-1], 0
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if not self.measurement:
            self.continue_(elapsed)
        elif self._setpoint is None or self._since_setpoint > self.timeout:
            self._since_measurement = 0
            self.passivate("waiting")
        else:
            self.command_n = self._answer(self._setpoint, self.measurement[-1])
            self._since_measurement = 0
            self.activate("commanding")

    def _answer(self, setpoint: Setpoint, motion: Motion) -> float:
        """The command in N; updates the integral."""
        gains, gone_s = self.gains, self._since_setpoint / SECOND
        position, rate, acceleration = setpoint
        error = position + gone_s * (rate + gone_s * acceleration / 2) - motion.position
        slip = rate + gone_s * acceleration - motion.rate
        integral = self.integral_n + gains.ki * error * self._since_measurement / SECOND
        wanted = gains.kp * error + integral + gains.kd * slip + self.inertia * acceleration
        command = max(-gains.limit, min(gains.limit, wanted))
        if not gains.winds_up(self.applied, wanted, error):
            self.integral_n = integral
        return command
