"""A vehicle's velocity becomes the speeds of its two treads or wheels."""

from typing import NamedTuple

from firmware_drivers.treads import STANDING, TreadSpeeds
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.errors import SettingError


class Velocity(NamedTuple):
    """Commanded velocity of a vehicle, in its own frame: x forward, z up."""

    forward_m_s: float
    turn_rad_s: float
    """Anticlockwise seen from above."""


class DifferentialDrive(Atomic):
    """Answers `velocity` with the `speeds` of both sides; stands when none came for `timeout` ns.

    standing, driving --velocity?--> sending (0) --speeds!--> driving (timeout), standing if (0, 0)
    driving --(timeout)--> sending (0) --speeds! (0, 0)--> standing

    What is faster than `full_speed_m_s` on one side slows both down alike, so the curve stays.
    """

    def __init__(
        self, name: str, track_width_m: float, full_speed_m_s: float, timeout: int
    ) -> None:
        super().__init__(name)
        if not (track_width_m > 0 and full_speed_m_s > 0 and timeout > 0):
            raise SettingError(
                f"track width {track_width_m} m, full speed {full_speed_m_s} m/s, "
                f"timeout {timeout} ns",
                where=name,
                expected="more than 0 of each",
            )
        self.velocity = self.in_port("velocity", Velocity)
        self.speeds_out = self.out_port("speeds", TreadSpeeds)
        self.track_width_m = track_width_m
        self.full_speed_m_s = full_speed_m_s
        self.timeout = timeout
        self.speeds = STANDING

    def output(self) -> None:
        """Send the speeds, or that there are none any more."""
        self.speeds_out.send(self.speeds if self.phase == "sending" else STANDING)

    def internal(self) -> None:
        """Wait for the next velocity, for no longer than the timeout while it moves."""
        if self.phase == "sending" and self.speeds != STANDING:
            self.hold_in("driving", self.timeout)
        else:
            self.speeds = STANDING
            self.passivate("standing")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- a new velocity counts from now
        """Take the newest velocity."""
        forward, turn = self.velocity[-1]
        aside = turn * self.track_width_m / 2
        left, right = forward - aside, forward + aside
        fastest = max(abs(left), abs(right), self.full_speed_m_s)
        self.speeds = TreadSpeeds(left / fastest, right / fastest)
        self.activate("sending")
