"""A PID controller that follows a moving setpoint: the error's own rate, and feed-forward.

What the setpoint's acceleration takes is added to the command before any error shows. Between two
setpoints the last one goes on with its rate and acceleration.
"""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.applied import Applied
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import PidGains
from firmware_runtime.models.trajectory import Setpoint


class TrackingPid(Atomic):
    """Answers every measurement with a command, at the same instant, while it has a setpoint.

    waiting --measurement?--> commanding (0) --command_n!--> waiting

    `inertia` is the command in N that an acceleration of 1 m/s2 or rad/s2 takes. `kd` acts on the
    difference of the rates. A setpoint older than `timeout` ns is none. The integral follows
    `applied` as that of `Pid` does.
    """

    def __init__(self, name: str, gains: PidGains, inertia: float, timeout: int) -> None:
        super().__init__(name)
        self.measurement = self.in_port("measurement", Motion)
        self.setpoint = self.in_port("setpoint", Setpoint)
        self.applied_in = self.in_port("applied", Applied)
        self.command = self.out_port("command_n", float)
        self.gains = gains
        self.inertia = inertia
        self.timeout = timeout
        self.applied = Applied.ALL
        self.integral_n = 0.0
        self.command_n = 0.0
        self._setpoint: Setpoint | None = None
        self._since_setpoint = 0
        self._since_measurement = 0

    def output(self) -> None:
        """Send the command."""
        self.command.send(self.command_n)

    def internal(self) -> None:
        """Wait for the next measurement."""
        self.passivate("waiting")

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
