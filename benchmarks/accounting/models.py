"""What the benches of the accounting step: models that do nothing but tick, and a hasty clock."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import HasDescriptor, MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.process import ProcessSettings

PERIOD = 10 * MILLISECOND
"""TachoBot's; what the runtime does once a second falls to a hundred steps."""

S = TypeVar("S", bound=HasDescriptor)


class Ticker(Atomic):
    """Ticks, period after period: waiting (period) --> waiting."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.period = PERIOD

    def initialize(self) -> None:
        """Wait."""
        self.hold_in("waiting", PERIOD)

    def internal(self) -> None:
        """Wait again."""
        self.hold_in("waiting", PERIOD)


def tickers(count: int) -> Coupled:
    """So many models, all due together, none coupled."""
    root = Coupled("root")
    for number in range(count):
        root.add(Ticker(f"ticker_{number}"))
    return root


class HastyClock(MonotonicClock):
    """Real time, but a wait is over at once: the clock is set to the deadline."""

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:  # noqa: ARG002 -- there are none
        """Be there."""
        self.start(until)
        return []


def configuration(directory: Path) -> Configuration:
    """A statistics file, and the collector of garbage."""
    return Configuration(
        process=ProcessSettings(freeze_garbage=True),
        statistics_path=directory / "tickers.stats",
    )
