"""A dual motor driver that answers as scripted, and the treads model on it."""

from typing import Any

from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.chips.step import Step
from firmware_drivers.treads import Treads, TreadSettings

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import HalError
from tests.support.scripted_bench import ScriptedBench
from tests.support.scripted_chip import ScriptedChip

STOP = "stop"


class ScriptedDriver(ScriptedChip):
    """Notes the speeds it was given as calls."""

    timeout_ns = 1000 * MILLISECOND

    def __init__(self) -> None:
        super().__init__()
        self.steps: list[HalError | None] = [None]
        self.drives: list[Md25Report | HalError | None] = [None]
        self.stops: list[HalError | None] = [None]

    def bring_up(self) -> tuple[Step, ...]:
        return (Step("identify", lambda: self.answer("step", self.steps), 10 * MILLISECOND),)

    def set_speeds(self, left: float, right: float) -> Md25Report | None:
        return self.answer((left, right), self.drives)

    def stop(self) -> None:
        self.answer(STOP, self.stops)

    @property
    def driven(self) -> list[tuple[Any, float]]:
        return [call for call in self.calls if call[0] != "step"]


def settings(**changes: object) -> TreadSettings:
    given = {"speed": 0.5, "refresh": 200 * MILLISECOND} | changes
    return TreadSettings(**given)  # type: ignore[arg-type]


class TreadsBench(ScriptedBench[ScriptedDriver]):
    @property
    def driven(self) -> str:
        """Each write as `ms:left/right` or `ms:stop`."""
        return " ".join(
            f"{at:.12g}:stop" if call == STOP else f"{at:.12g}:{call[0] + 0.0:g}/{call[1] + 0.0:g}"
            for call, at in self.chip.driven
        )


def bench_of(driver: ScriptedDriver, treads: TreadSettings) -> TreadsBench:
    return TreadsBench(Treads("treads", driver, treads), driver)
