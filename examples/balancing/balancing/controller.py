"""The controller: it waits to be raised, balances, and lets go of the motors when it falls.

It begins when its outputs are enabled: a hand that holds it waits for its motors to push.

It knows neither chips nor clocks; the same object runs in simulation and on the robot.
"""

from firmware_drivers.chips.mpu9250_burst import InertialSample

from balancing.lean import Lean
from balancing.ready import Ready
from balancing.rolling import Rolling, rolling_check
from balancing.settings import ControllerTable
from balancing.tilt import Tilt
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.models.motion import Applied
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State

MODE = (
    State("Lying", NEVER, Arrow("ready?1", "Raised")),
    State("Raised", "steady", Arrow("ready?0", "Lying"), Arrow("balance!1", "Balancing")),
    State("Balancing", NEVER, Arrow("ready?0", "Fallen")),
    State("Fallen", 0, Arrow("balance!0", "Lying")),
)


class Mode(StateDiagram):
    """Balances from when it was ready for `steady` ns until it is not.

    X: ready, 1 or 0. Y: balance, 1 from now on, 0 no more.
    """

    def __init__(self, name: str, steady: int) -> None:
        super().__init__(name)
        self.ready = self.in_port("ready", int)
        self.balance = self.out_port("balance", int)
        self.follow(MODE, steady=steady)


class Helm(Atomic):
    """Passes the PID's command on to the motors while the robot balances; stops them once after.

    waiting --command?, balance?--> driving (0) --drive!--> waiting
    waiting --applied?, balance?--> driving (0) --effect!--> waiting

    `effect` is what becomes of the PID's commands, for its integral: what the motors apply, or
    nothing where they are not passed on.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.balance = self.in_port("balance", int)
        self.command = self.in_port("command", float)
        self.applied_in = self.in_port("applied", Applied)
        self.drive_out = self.out_port("drive", float)
        self.effect_out = self.out_port("effect", Applied)
        self.is_balancing = False
        self.drive: float | None = None
        self.by_motors = Applied.NOTHING
        self.effect: Applied | None = None

    def output(self) -> None:
        """Send the drive, a share of full voltage, forward positive."""
        if self.drive is not None:
            self.drive_out.send(self.drive)
        if self.effect is not None:
            self.effect_out.send(self.effect)

    def internal(self) -> None:
        """Wait for the next command."""
        self.drive = self.effect = None
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Drive under the body: leaning forward is a drive forward, against the PID's sign."""
        if self.balance:
            self.is_balancing = self.balance[-1] == 1
        if self.is_balancing and self.command:
            self.drive = -self.command[-1]
        elif self.balance and not self.is_balancing:
            self.drive = 0.0
        if self.applied_in:
            self.by_motors = self.applied_in[-1]
        if self.applied_in or self.balance:
            self.effect = self.by_motors if self.is_balancing else Applied.NOTHING
        if self.drive is None and self.effect is None:
            self.continue_(elapsed)
        else:
            self.activate("driving")


class Controller(Coupled):
    """sample -> tilt -> pid -> helm -> drive, while mode says so; lean gives the pitch to hold.

    tilt's upright, enabled, rolling_check's agrees -> ready -> mode
    what the motors apply -> helm -> pid, lean, rolling
    """

    def __init__(self, name: str, settings: ControllerTable) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.enabled = self.in_port("enabled", int)
        self.place = self.in_port("place", float)
        self.applied = self.in_port("applied", Applied)
        self.drive = self.out_port("drive", float)
        filtering = seconds(settings.tilt_time_constant_s)
        lean = settings.lean_per_speed_rad, settings.lean_per_place_rad_s, settings.full_speed_m_s
        self.tilt = self.add(Tilt("tilt", filtering, settings.upright_rad))
        self.ready = self.add(Ready("ready"))
        self.mode = self.add(Mode("mode", seconds(settings.steady_s)))
        self.pid = self.add(Pid("pid", gains(settings), reference=0.0))
        self.helm = self.add(Helm("helm"))
        self.lean = self.add(Lean("lean", *lean))
        stated = settings.rolling_check
        self.rolling = self.add(Rolling("rolling", stated, settings.full_speed_m_s))
        self.rolling_check = self.add(rolling_check(stated))

        self.couple(self.sample, self.tilt.sample)
        self.couple(self.tilt.pitch, self.pid.measurement)
        self.couple(self.tilt.upright, self.ready.upright)
        self.couple(self.enabled, self.ready.enabled)
        self.couple(self.ready.ready, self.mode.ready)
        self.couple(self.mode.balance, self.helm.balance)
        self.couple(self.mode.balance, self.lean.begin)
        self.couple(self.place, self.lean.place_in)
        self.couple(self.pid.command, self.helm.command)
        self.couple(self.helm.drive_out, self.lean.drive)
        self.couple(self.lean.pitch_out, self.pid.reference_in)
        self.couple(self.helm.drive_out, self.drive)
        self.couple(self.applied, self.helm.applied_in)
        self.couple(self.helm.effect_out, self.pid.applied_in)
        self.couple(self.helm.effect_out, self.lean.applied_in)
        self.couple(self.sample, self.rolling.sample)
        self.couple(self.tilt.pitch, self.rolling.pitch)
        self.couple(self.helm.drive_out, self.rolling.drive)
        self.couple(self.mode.balance, self.rolling.balance)
        self.couple(self.helm.effect_out, self.rolling.applied_in)
        self.couple(self.rolling.roll_out, self.rolling_check.rate)
        self.couple(self.rolling.roll_out, self.rolling_check.value)
        self.couple(self.rolling_check.agrees_out, self.ready.trusted)

    def retune(self, settings: ControllerTable) -> None:
        """Take up new gains; the integral stays, so nothing jumps."""
        self.pid.gains = gains(settings)
        self.lean.per_speed_rad = settings.lean_per_speed_rad
        self.lean.per_place_rad_s = settings.lean_per_place_rad_s


def gains(settings: ControllerTable) -> PidGains:
    """The PID's gains; its command is a share of full voltage here."""
    return PidGains(settings.kp, settings.ki, settings.kd, limit=settings.max_drive)
