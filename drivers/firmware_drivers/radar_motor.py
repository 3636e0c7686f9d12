"""The motor that turns the radar's head as a hardware atomic model, on an H-bridge."""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE, STILL, Motors
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import NotReady

_SENSE: Final = MappingProxyType({STILL: 0, CLOCKWISE: 1, COUNTERCLOCKWISE: -1})


@dataclass(frozen=True, slots=True)
class RadarMotorSettings:
    """How fast the head turns, and for how long at most."""

    duty: float
    """Share of full voltage while turning."""
    frequency_hz: float
    """PWM frequency; it is the whole chip's."""
    longest_turn: int = NEVER
    """Ns without a signal after which a turning head is stopped: no chip here would stop it."""


class RadarMotor(Motors):
    """Obeys `turn`: 0 brakes, 1 turns clockwise, 2 counterclockwise.

    The phases are those of `Motors`, without refresh. Standing still is braked, so that the head
    stays where it saw something; after a fault and at the end all outputs are full-off instead.
    """

    def __init__(
        self,
        name: str,
        bridge: HBridge,
        settings: RadarMotorSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(
            name,
            lambda: bridge.bring_up(settings.frequency_hz),
            bridge.chip.line,
            command_timeout=settings.longest_turn,
            interlock=interlock,
        )
        if not 0.0 < settings.duty <= 1.0 or settings.longest_turn <= 0:
            raise SettingError(
                f"{name} on {bridge.place}: duty {settings.duty}, longest_turn "
                f"{settings.longest_turn} ns",
                expected="more than 0, a duty of 1 at most",
            )
        self.turn = self.in_port("turn", int)
        self.bridge = bridge
        self.settings = settings
        self.signal = STILL

    def take_command(self) -> None:
        """Read the signal."""
        signal = self.turn[-1]
        if signal not in _SENSE:
            raise NotReady(f"signal {signal}, expected 0, 1 or 2; stopped", where=self.turn.path)
        self.signal = signal

    def forget_command(self) -> None:
        """Make the head stand."""
        self.signal = STILL

    def is_moving(self) -> bool:
        """Whether the head is to turn."""
        return self.signal != STILL

    def write_command(self) -> None:
        """Turn or brake, if the chip is as set: reset, it would acknowledge and do nothing."""
        self.bridge.chip.poll()
        self.bridge.drive(_SENSE[self.signal] * self.settings.duty)

    def write_stop(self) -> None:
        """Turn all sixteen outputs of the chip full-off, right in any state of it."""
        self.bridge.chip.stop_all()
