"""The two treads of a vehicle as a hardware atomic model, on an MD25 or a Sabertooth."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.hardware import Chip
from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE, STILL, Motors
from firmware_drivers.wheel_check import WheelCheck
from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import NotReady
from firmware_runtime.models.motion import Applied


class TreadSpeeds(NamedTuple):
    """Speeds of both treads as shares of full speed, -1 to 1, positive forward."""

    left: float
    right: float


STANDING = TreadSpeeds(0.0, 0.0)


class TreadDriver(Chip, Protocol):
    """A dual motor driver that stops its motors by itself when nothing is sent to it."""

    @property
    def timeout_ns(self) -> int:
        """Silence after which the motors stop."""

    def set_speeds(self, left: float, right: float) -> Md25Report | None:
        """Set both speeds, and give what the chip says of itself if it can speak."""

    def stop(self) -> None:
        """Set both speeds to zero, in any state of the chip."""


@dataclass(frozen=True, slots=True)
class TreadSettings:
    """Meaning of a signal, and the period of writes to the driver."""

    speed: float
    """Share of full speed that signals 1 and 2 stand for."""
    refresh: int
    """Ns until the last speeds are sent again while moving."""
    left_reversed: bool = False
    right_reversed: bool = False
    """A motor that is wired or mounted the other way round."""
    full_counts_s: float | None = None
    """Counts of a wheel's encoder in a second at full speed; None where there is no encoder."""
    ramp: int = 0
    """Ns that a motor takes from rest to full speed."""
    command_timeout: int = NEVER
    """Ns without any signal or speeds after which moving treads are stopped."""

    def faults(self, timeout_ns: int) -> tuple[str, ...]:
        """List every setting that cannot be with a driver of that timeout, a sentence each."""
        faults = []
        if not 0.0 < self.speed <= 1.0:
            faults.append(f"speed: {self.speed}, expected more than 0, 1 at most")
        if not 0 < self.refresh <= timeout_ns // 2:
            faults.append(
                f"refresh: {self.refresh / 1e6:g} ms, expected more than 0, at most "
                f"{timeout_ns / 2e6:g} ms, half the driver's timeout"
            )
        if self.full_counts_s is not None and not 0 < self.full_counts_s < math.inf:
            faults.append(f"full_counts_s: {self.full_counts_s}, expected a number above 0")
        if self.command_timeout <= 0:
            faults.append(f"command_timeout: {self.command_timeout} ns, expected more than 0")
        return tuple(faults)


class Treads(Motors):
    """Obeys `right` and `left` (0 stop, 1 clockwise: forward, 2 counterclockwise) and `speeds`.

    A wheel that its encoder contradicts is a fault, as one of the bus is (`wheel_check`); for that
    the driver is read while the treads stand, too, as long as the interlock enables outputs.

    The phases are those of `Motors`. `report` is what the driver says of itself, where it can.
    Speeds are clipped to -1 to 1; at one instant a signal goes before speeds for its own side.
    """

    def __init__(
        self,
        name: str,
        driver: TreadDriver,
        settings: TreadSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(
            name,
            driver.bring_up,
            driver.line,
            refresh=settings.refresh,
            command_timeout=settings.command_timeout,
            interlock=interlock,
        )
        faults = settings.faults(driver.timeout_ns)
        if faults:
            raise SettingError(f"{name} on {driver.place}: {'; '.join(faults)}")
        self.right = self.in_port("right", int)
        self.left = self.in_port("left", int)
        self.speeds = self.in_port("speeds", TreadSpeeds)
        self.report_out = self.out_port("report", Md25Report)
        self.driver = driver
        self.settings = settings
        self.command = STANDING
        self.report: Md25Report | None = None
        self._is_clipped = False
        self._since_report = 0
        self._wheels = () if settings.full_counts_s is None else self._checked(settings)
        if self._wheels:
            self.watch_every = settings.refresh

    def _checked(self, settings: TreadSettings) -> tuple[WheelCheck, ...]:
        counts = settings.full_counts_s or 0.0
        return tuple(
            WheelCheck(self.path, each, counts, settings.ramp) for each in ("left", "right")
        )

    def output(self) -> None:
        """Send what the driver said, and faults."""
        super().output()
        if self.report is not None:
            self.report_out.send(self.report)

    def proceed(self) -> None:
        """Go on as motors do; a report is sent once."""
        self.report = None
        super().proceed()

    def internal(self) -> None:
        """Go on as motors do."""
        self._since_report += self.sigma
        super().internal()

    def external(self, elapsed: int) -> None:
        """Take a command as motors do."""
        self._since_report += elapsed
        super().external(elapsed)

    def take_command(self) -> None:
        """Read the ports: speeds for both, then signals for one side each."""
        self._is_clipped = False
        if self.speeds:
            self.command = self._clipped(self.speeds[-1])
            self._is_clipped = self.command != self.speeds[-1]
        if self.left:
            self.command = self.command._replace(left=self._speed_of(self.left))
        if self.right:
            self.command = self.command._replace(right=self._speed_of(self.right))

    def forget_command(self) -> None:
        """Make both treads stand."""
        self.command = STANDING
        self._is_clipped = False

    def is_moving(self) -> bool:
        """Return whether a tread is to turn."""
        return self.command != STANDING

    def write_command(self) -> None:
        """Write both speeds as the motors are mounted."""
        left, right = self.command
        left = -left if self.settings.left_reversed else left
        right = -right if self.settings.right_reversed else right
        self.report = report = self.driver.set_speeds(left, right)
        elapsed, self._since_report = self._since_report, 0
        if report is None or not self._wheels:
            return
        wheels = tuple(zip(self._wheels, _counts_of(report), strict=True))
        if any(wheel.is_unasked(count, elapsed) for wheel, count in wheels):
            # once more: a wrong byte is no turn
            self.report = report = self.driver.set_speeds(left, right) or report
        speeds = left, right
        for wheel, count, speed in zip(self._wheels, _counts_of(report), speeds, strict=True):
            wheel.take(count, elapsed, speed)

    def has_acted(self) -> bool:
        """Return whether both wheels have turned as told since one did not."""
        return all(wheel.agrees for wheel in self._wheels)

    def look_after(self) -> None:
        """Read the driver; wheels that may be pushed by hand are not looked at."""
        if self.interlock():
            self.write_and_report()
            return
        for wheel in self._wheels:
            wheel.begin_again()
        self.settle()

    def written_of_command(self) -> Applied:
        """Part where speeds beyond -1 to 1 were clipped."""
        return Applied.PART if self._is_clipped else Applied.ALL

    def write_stop(self) -> None:
        """Stop both."""
        for wheel in self._wheels:
            wheel.begin_again()
        self.driver.stop()

    # ---------------------------------------------------------------------------------------------

    def _speed_of(self, port: InPort[int]) -> float:
        speed = self.settings.speed
        speeds = {STILL: 0.0, CLOCKWISE: speed, COUNTERCLOCKWISE: -speed}
        signal = port[-1]
        if signal not in speeds:
            raise NotReady(f"signal {signal}, expected 0, 1 or 2; stopped", where=port.path)
        return speeds[signal]

    def _clipped(self, speeds: TreadSpeeds) -> TreadSpeeds:
        if not all(map(math.isfinite, speeds)):
            raise NotReady(
                f"speeds {tuple(speeds)}", where=self.speeds.path, expected="finite numbers"
            )
        left, right = (max(-1.0, min(1.0, speed)) for speed in speeds)
        return TreadSpeeds(left, right)


def _counts_of(report: Md25Report) -> tuple[int, int]:
    """The encoders of both wheels, the left one first."""
    return report.left_encoder, report.right_encoder
