"""The assertion that a run kept its limits of timing, which knows where it cannot decide.

Limits that are kept pass. Limits that are broken fail where the conditions are a robot's: real-time
priority, no virtual machine, no busy neighbours, the governor `performance`, late steps by causes
of the run's own. Elsewhere the test is skipped with the reason, as it is where nothing was
measured.
"""

from collections.abc import Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Protocol, TypeAlias

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
        """Return the counts."""


Run: TypeAlias = "HasStatistics | Figures | str | PathLike[str]"
"""A run, its figures, or the path of a statistics file."""


def assert_timing(
    run: Run,
    *,
    strict: bool = False,
    neighbours: Mapping[str, float] | None = None,
    **limits: Any,  # noqa: ANN401 -- those of Limits
) -> None:
    """Fail the test whose run broke one of `Limits`; skip it where the machine may be why.

    With `strict` what is broken fails wherever it runs, and so does what was not measured.
    `neighbours` are shares of the processors that others took meanwhile, by `Neighbours`. Raises
    ConfigError for limits that are none and a model that is not there.
    """
    __tracebackhide__ = True
    figures = _figures(run)
    others = [] if neighbours is None else busy(neighbours)
    judged = judge(figures, Limits(**limits), others, strict=strict)
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
