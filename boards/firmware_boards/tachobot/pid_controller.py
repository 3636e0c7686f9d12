"""Base of TachoBot's controllers: a PID a coordinate, and a delay of the yaw command."""

from typing import Generic, Protocol, TypeVar

from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.settings import (
    MovementCheckSettings,
    PidSettings,
    TachobotSettings,
)
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.time import seconds
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.models.movement_watch import MovementWatch, MovementWatchSettings
from firmware_runtime.models.pid import PidGains


class AnyPid(Protocol):
    """A PID of either kind."""

    gains: PidGains
    applied_in: InPort[Applied]


P = TypeVar("P", bound=AnyPid)


class PidController(Coupled, Generic[P]):
    """PIDs by their keys below `controller` in board.toml; two pairs push for each."""

    def __init__(self, name: str, pair_thrust_n: float) -> None:
        super().__init__(name)
        self.applied = self.in_port("applied", Applied)
        """Forces that the thrust pairs apply."""
        self.unsteered = self.in_port("unsteered", Fault)
        """Nothing reaches the thrust pairs, and it hovers."""
        self._pids: dict[str, P] = {}
        self._limit_n = 2 * pair_thrust_n

    def retune(self, settings: TachobotSettings) -> None:
        """Take up new gains; integrals stay, so nothing jumps."""
        for name, pid in self._pids.items():
            pid.gains = self._gains(getattr(settings.controller, name))

    def _couple_applied(self, allocation: Allocation) -> None:
        """Give each PID what the pairs apply: those of x and y by way of the allocation."""
        self.couple(self.applied, allocation.pairs_applied)
        for name, pid in self._pids.items():
            if name == "yaw":
                self.couple(self.applied, pid.applied_in)
            else:
                self.couple(allocation.position_applied, pid.applied_in)

    def _couple_yaw(
        self,
        command: OutPort[float],
        motion: OutPort[Motion],
        allocation: Allocation,
        settings: MovementCheckSettings,
    ) -> OutPort[Fault]:
        """Lead the yaw command to the allocation, as long as the robot turns that it drives.

        Returns what says that the rate can no longer be believed.
        """
        check = self.add(movement_check(settings))
        self.couple(motion, check.motion)
        self.couple(command, check.command)
        self.couple(command, allocation.yaw_n)
        self.couple(self.applied, check.applied_in)
        self.couple(check.moves, allocation.moves)
        return check.contradiction

    def _gains(self, settings: PidSettings) -> PidGains:
        return PidGains(settings.kp, settings.ki, settings.kd, self._limit_n, settings.anti_windup)

    def _delayed(self, command: OutPort[float], delay_s: float) -> OutPort[float]:
        """The port at which the yaw command leaves after the delay; its own where there is none."""
        if not delay_s:
            return command
        from firmware_runtime.models.delay import Delay  # noqa: PLC0415 -- few runs have one

        delay = self.add(Delay("yaw_delay", float, seconds(delay_s)))
        self.couple(command, delay.entrance)
        return delay.delayed


def movement_check(settings: MovementCheckSettings) -> MovementWatch:
    """The gyro against what drives it: motors may have no supply, and the robot may be caught."""
    return MovementWatch(
        "movement_check",
        MovementWatchSettings(
            quantity="yaw rate (rad/s)",
            command=settings.effort_n,
            still=settings.still_rad_s,
            impulse=settings.impulse_n_s,
            again=seconds(settings.again_s),
        ),
    )
