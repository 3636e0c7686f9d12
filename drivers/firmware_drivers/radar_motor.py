"""The motor that turns the radar's head as a hardware atomic model, on an H-bridge."""

from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.step import Step
from firmware_drivers.dc_motor import BridgeMotor
from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE, STILL
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import NotReady

_SENSE: Final = MappingProxyType({STILL: 0, CLOCKWISE: 1, COUNTERCLOCKWISE: -1})


@dataclass(frozen=True, slots=True)
class RadarMotorSettings:
    """Speed of the head, and its longest time without a command."""

    duty: float
    """Share of full voltage while turning."""
    frequency_hz: float
    """PWM frequency; it is the whole chip's."""
    longest_turn: int = NEVER
    """Ns without a signal after which a turning head is stopped: no chip here would stop it."""


class RadarMotor(BridgeMotor):
    """Obeys `turn`: 0 brakes, 1 turns clockwise, 2 counterclockwise.

    Standing still is braked, so that the head stays where it saw something; at a stop all outputs
    of the chip are full-off.
    """

    keeps_commands = True

    def __init__(
        self,
        name: str,
        bridge: HBridge,
        settings: RadarMotorSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        def bring_up() -> Iterable[Step]:
            return bridge.bring_up(settings.frequency_hz)

        super().__init__(name, bridge, bring_up, settings.longest_turn, interlock, brakes=True)
        if not 0.0 < settings.duty <= 1.0 or settings.longest_turn <= 0:
            raise SettingError(
                f"{name} on {bridge.place}: duty {settings.duty}, longest_turn "
                f"{settings.longest_turn} ns",
                expected="more than 0, a duty of 1 at most",
            )
        self.turn = self.in_port("turn", int)
        self.settings = settings

    def take_command(self) -> None:
        """Read the signal."""
        signal = self.turn[-1]
        if signal not in _SENSE:
            raise NotReady(f"signal {signal}, expected 0, 1 or 2; stopped", where=self.turn.path)
        self.commanded = _SENSE[signal] * self.settings.duty

    def write_stop(self) -> None:
        """Turn all sixteen outputs of the chip full-off, right in any state of it."""
        self.bridge.chip.stop_all()
