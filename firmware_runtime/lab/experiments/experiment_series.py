"""Experiments of one board, one after the other: each with its files, an index and results.json."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from firmware_runtime.board.experiments import Experiment
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError
from firmware_runtime.lab.experiments.index_page import Line, index_page
from firmware_runtime.lab.experiments.packages import missing_packages
from firmware_runtime.lab.experiments.results import Results, leave
from firmware_runtime.lab.experiments.trial import Say, Trial

RESULTS, INDEX = "results.json", "index.html"


@dataclass(frozen=True, slots=True)
class Series:
    """What became of each experiment, in order."""

    results: Mapping[str, Results]
    faults: Mapping[str, str]
    """By the name of an experiment that failed: why."""
    not_run: Mapping[str, str]
    """By the name of an experiment that lacks packages: which."""

    def document(self, experiments: Mapping[str, Experiment]) -> dict[str, object]:
        """results.json: `{name: {"figure": ..., "ours": {...}, "paper": {...}}}`.

        An experiment that failed or was not run has no numbers of ours, and says why.
        """
        found: dict[str, object] = {}
        for name, experiment in experiments.items():
            if name in self.results:
                found[name] = self.results[name].entry()
            else:
                why = "failed" if name in self.faults else "not_run"
                said = self.faults.get(name) or self.not_run[name]
                paper = dict(experiment.paper)
                found[name] = {"figure": experiment.figure, "ours": {}, "paper": paper, why: said}
        return found


def run_series(trials: Sequence[Trial], say: Say) -> Series:
    """Run each and write its files; one that fails leaves none, and the next one is run.

    Those that lack packages are said first and not run. Raises ConfigError if that is all of them.
    """
    not_run = _not_run(trials)
    runnable = [trial for trial in trials if trial.name not in not_run]
    if not runnable:
        raise ConfigError("experiment", [f"{name}: {why}" for name, why in not_run.items()])
    for name, why in not_run.items():
        say(f"{name} will not be run: {why}")
    results: dict[str, Results] = {}
    faults: dict[str, str] = {}
    begin = monotonic()
    for number, trial in enumerate(runnable, 1):
        say(f"[{number}/{len(runnable)}] {trial.name}, {monotonic() - begin:.0f} s since the start")
        try:
            results[trial.name] = _tried(trial)
        except FirmwareRuntimeError as error:
            faults[trial.name] = str(error)
            say(f"{trial.name} failed: {error}")
    return Series(results, faults, not_run)


def _not_run(trials: Sequence[Trial]) -> dict[str, str]:
    """Those that lack packages, and which."""
    missing = ((trial.name, missing_packages(trial.experiment)) for trial in trials)
    return {name: why for name, why in missing if why is not None}


def _tried(trial: Trial) -> Results:
    """Run one in a folder of its own, so that nothing of it stays if it fails."""
    with TemporaryDirectory(prefix=f".{trial.name}-", dir=trial.folder) as own:
        results, _ = leave(replace(trial, folder=Path(own)))
        for each in Path(own).iterdir():
            each.rename(trial.folder / each.name)
    return results


def write_series(series: Series, trials: Sequence[Trial], folder: Path) -> list[str]:
    """Write the index and results.json beside the experiments' files; return their names."""
    experiments = {trial.name: trial.experiment for trial in trials}
    document = series.document(experiments)
    (folder / RESULTS).write_text(json.dumps(document, indent=1, allow_nan=False) + "\n")
    board = trials[0].board.name
    page = index_page(board, list(_lines(series, experiments)))
    (folder / INDEX).write_text(page, "utf-8")
    return [RESULTS, INDEX]


def _lines(series: Series, experiments: Mapping[str, Experiment]) -> Iterator[Line]:
    for name, experiment in experiments.items():
        results = series.results.get(name)
        findings = None if results is None else results.findings
        fault, not_run = series.faults.get(name), series.not_run.get(name)
        yield Line(name, experiment, findings, fault, not_run)
