"""What judges the late steps of a run: loaded in real time only, where steps can be late."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.bus_meter import BusMeter
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.step import Step

if TYPE_CHECKING:
    from firmware_runtime.executive.blame.blamer import Blamer


def blamer_for(
    clock: Clock, step: Step, accounts: Sequence[ModelAccount], meters: Sequence[BusMeter]
) -> "Blamer | None":
    """What judges the late steps of a run; None on a clock that is not the machine's."""
    if not (isinstance(clock, MonotonicClock) and clock.speed == 1):
        return None
    from firmware_runtime.executive.blame.blamer import Blamer  # noqa: PLC0415

    return Blamer(clock, step, accounts, meters)
