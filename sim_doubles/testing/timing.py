"""The assertion that a run kept its limits of timing, which knows where it cannot decide.

Limits that are kept pass. Limits that are broken fail where the conditions are a robot's: real-time
priority, no virtual machine, no busy neighbours, the governor `performance`, late steps by causes
of the run's own. Elsewhere the test is skipped with the reason, as it is where nothing was
measured.
"""

from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Protocol, TypeAlias

import pytest

from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.system.conditions import busy
from sim_doubles.testing.limits import Judgement, Limits, judge


class HasStatistics(Protocol):
    """An open board or model, or what its `run` returned."""

    @property
    def statistics(self) -> Figures:
        """What has been counted."""


Run: TypeAlias = "HasStatistics | Figures | str | PathLike[str]"
"""A run, its figures, or the path of a statistics file."""


def assert_timing(  # noqa: PLR0913 -- limits, by name
    run: Run,
    *,
    p99_us: float | None = None,
    max_us: float | None = None,
    step_p99_us: float | None = None,
    step_max_us: float | None = None,
    skips: int | None = None,
    overruns: int | None = None,
    misses: int | None = None,
    model: str | None = None,
    strict: bool = False,
    neighbours: Mapping[str, float] | None = None,
) -> None:
    """Fail the test whose run broke a limit; skip it where that may be the machine's doing.

    Each limit is `at most`; see `sim_doubles.testing.limits.Limits`. With `strict` what is broken
    fails wherever it runs, and so does what was not measured. `neighbours` are shares of the
    processors that others took meanwhile, by `Neighbours`. Raises ConfigError for limits that are
    none and a model that is not there.
    """
    __tracebackhide__ = True
    limits = Limits(p99_us, max_us, step_p99_us, step_max_us, skips, overruns, misses, model)
    figures = _figures(run)
    others = [] if neighbours is None else busy(neighbours)
    judged = judge(figures, limits, others, strict=strict)
    if judged.judgement is Judgement.BROKEN:
        report = "\n".join(statistics_text(figures))
        pytest.fail(f"{judged}\n\n{report}", pytrace=False)
    if judged.judgement is Judgement.CANNOT_TELL:
        said = "; ".join((*judged.broken, *judged.unmeasured, *judged.reasons))
        pytest.skip(f"{judged.judgement}: {said} (strict=True would fail)")


def _figures(run: Run) -> Figures:
    if isinstance(run, Figures):
        return run
    if isinstance(run, str | PathLike):
        return read_statistics(Path(fspath(run))).figures()
    return run.statistics
