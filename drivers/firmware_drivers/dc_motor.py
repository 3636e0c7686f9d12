"""One DC motor on an H-bridge as a hardware atomic model: driven by a share of full voltage."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import POLL
from firmware_drivers.chips.pca9685_registers import duty_burst
from firmware_drivers.chips.step import Step
from firmware_drivers.motors import Motors
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import NotReady
from firmware_runtime.models.motion import Applied

TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (*POLL, duty_burst(3))
"""Transactions of one command, on neighbouring channels, for the bus-time budget."""
WRITTEN_EVERY: Final = 250 * MILLISECOND
"""Ns between two commands that are written to a motor that turns, or that brakes: under a chip that
was reset, or whose outputs were disabled meanwhile, it is free until the next one."""


@dataclass(frozen=True, slots=True)
class DcMotorSettings:
    """The PWM frequency, and how long a command holds."""

    frequency_hz: float
    """It is the whole chip's."""
    timeout: int
    """Ns without a new command after which a turning motor is stopped."""
    brakes: bool = False
    """Whether a command of 0 brakes. Where one wire to the bridge breaks, a brake drives at full
    voltage; otherwise 0 turns all outputs off, and the motor runs down."""


class BridgeMotor(Motors):
    """A motor on an H-bridge, driven by `commanded`, -1 to 1 of full voltage; 0 brakes or lets go.

    The phases are those of `Motors`; its refresh finds a chip that was reset under a motor that
    turns or brakes. After a fault and at the end its outputs are full-off in any case.
    """

    def __init__(  # noqa: PLR0913 -- chip, then how it is driven
        self,
        name: str,
        bridge: HBridge,
        bring_up: Callable[[], Iterable[Step]],
        timeout: int,
        interlock: Interlock,
        *,
        brakes: bool,
    ) -> None:
        super().__init__(
            name,
            bring_up,
            bridge.chip.line,
            refresh=WRITTEN_EVERY,
            command_timeout=timeout,
            interlock=interlock,
        )
        self.bridge = bridge
        self.brakes = brakes
        self.commanded = 0.0

    def forget_command(self) -> None:
        """Command the motor to stand."""
        self.commanded = 0.0

    def is_moving(self) -> bool:
        """Return whether the motor is commanded to turn."""
        return self.commanded != 0.0

    def settle(self) -> None:
        """Obey, drive on, brake on, or stand with outputs full-off: that one is left alone."""
        is_braked = self.brakes and self.applied is not Applied.NOTHING
        self.watch_every = WRITTEN_EVERY if is_braked else NEVER
        super().settle()

    def look_after(self) -> None:
        """Brake on, while outputs are enabled."""
        if self.interlock():
            self.write_and_report()
        else:
            self.wait_until_enabled()

    def write_command(self) -> None:
        """Do as told, if the chip is as set: reset, it would acknowledge and do nothing."""
        self.bridge.chip.poll()
        if self.is_moving() or self.brakes:
            self.bridge.drive(self.commanded)
        else:
            self.bridge.off()


class DcMotor(BridgeMotor):
    """Obeys `drive`, -1 to 1 of full voltage; other models may drive other outputs of the chip.

    0 turns its outputs off, or brakes where the settings say so.
    """

    def __init__(
        self,
        name: str,
        bridge: HBridge,
        settings: DcMotorSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        def bring_up() -> Iterable[Step]:
            return bridge.share_bring_up(settings.frequency_hz)

        super().__init__(
            name, bridge, bring_up, settings.timeout, interlock, brakes=settings.brakes
        )
        if settings.timeout <= 0:
            raise SettingError(
                f"{name} on {bridge.place}: timeout {settings.timeout} ns", expected="more than 0"
            )
        self.drive = self.in_port("drive", float)

    def take_command(self) -> None:
        """Read the command."""
        drive = self.drive[-1]
        if not (math.isfinite(drive) and -1.0 <= drive <= 1.0):
            raise NotReady(f"drive {drive}, expected -1 to 1; stopped", where=self.drive.path)
        self.commanded = drive

    def write_stop(self) -> None:
        """Turn the bridge's outputs full-off, right in any state of the chip."""
        self.bridge.stop()
