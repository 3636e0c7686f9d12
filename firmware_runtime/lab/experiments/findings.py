"""Findings of an experiment: numbers, data, plots and tables."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from firmware_runtime.view.parts import Part


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """Everything that goes into an experiment's files.

    Names of plots and data are what stands in the file's name behind the experiment's: `` for
    `yaw-step.svg`, `network` for `yaw-step-network.svg`.
    """

    ours: Mapping[str, float | None] = field(default_factory=dict)
    """Our numbers, by the paper's keys where it has them; None: did not happen, and is left out."""
    sentences: Sequence[str] = ()
    """Findings in words: printed, and first on the page."""
    plots: Mapping[str, Part] = field(default_factory=dict)
    data: Mapping[str, Iterable[str]] = field(default_factory=dict)
    """Lines of CSV, without line ends."""
    tables: Sequence[Part] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    """More for the JSON file; whatever msgspec can encode."""
    between: Sequence[str] = ()
    """Link between controller and robot, a sentence a stage, for the page's conditions."""
