"""What an experiment leaves: data (CSV), figures (JSON), plots (SVG), recordings and a page."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.registry import Board
from firmware_runtime.lab.experiments.experiment_page import experiment_page
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.kinds import run_experiment
from firmware_runtime.lab.experiments.run_conditions import conditions
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.view.line_plot import LinePlot


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """One experiment with one board, and what it found."""

    name: str
    board: Board
    """With the experiment's settings in it."""
    experiment: Experiment
    findings: Findings

    @property
    def ours(self) -> dict[str, float]:
        """Our numbers; what did not happen is left out."""
        return {name: value for name, value in self.findings.ours.items() if value is not None}

    def entry(self) -> dict[str, Any]:
        """What stands of it in results.json."""
        experiment = self.experiment
        return {"figure": experiment.figure, "ours": self.ours, "paper": dict(experiment.paper)}


def leave(trial: Trial) -> tuple[Results, list[str]]:
    """Run an experiment and write its files; return what it found, and their names.

    Raises ConfigError for one that failed, OSError for files that cannot be written.
    """
    results = Results(
        name=trial.name,
        board=trial.board,
        experiment=trial.experiment,
        findings=run_experiment(trial),
    )
    return results, _write(results, trial.folder)


def _write(results: Results, folder: Path) -> list[str]:
    """Write every file beside the recordings; return the names of all, the page's last."""
    texts = dict(_texts(results))
    for name, text in texts.items():
        (folder / name).write_text(text, "utf-8")
    recordings = sorted(path.name for path in folder.glob(f"{results.name}*.recording*"))
    files = [*texts, *recordings]
    page = experiment_page(results.board, results.experiment, results.findings, files)
    (folder / f"{results.name}.html").write_text(page, "utf-8")
    return [*files, f"{results.name}.html"]


def _texts(results: Results) -> Iterator[tuple[str, str]]:
    """Data, figures and plots, by the names of their files."""
    findings, name = results.findings, results.name
    for suffix, lines in findings.data.items():
        yield f"{_named(name, suffix)}.csv", "".join(f"{line}\n" for line in lines)
    encoded = msgspec.json.encode(_figures(results))
    yield f"{name}.json", msgspec.json.format(encoded).decode() + "\n"
    for suffix, plot in findings.plots.items():
        text = plot.text() if isinstance(plot, LinePlot) else plot.text
        yield f"{_named(name, suffix)}.svg", text


def _figures(results: Results) -> Mapping[str, Any]:
    """What is in the JSON file."""
    return {
        "experiment": results.name,
        "board": results.board.name,
        "title": results.experiment.title,
        **results.entry(),
        **results.findings.details,
        "published": list(results.experiment.published),
        "settings": list(results.board.assignments),
        "conditions": conditions(),
    }


def _named(name: str, suffix: str) -> str:
    return f"{name}-{suffix}" if suffix else name
