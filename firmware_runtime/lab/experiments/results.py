"""Runs experiments and writes their files: data (CSV), figures (JSON), plots (SVG), pages.

Plots are files of their own only where the extra `plot` is installed; the pages hold them anyway.
Recordings of the runs stand beside them. Experiments of one board, one after the other, have an
index and results.json as well.
"""

import json
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Final

import msgspec

from firmware_runtime.board.experiments import OwnExperiment
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.lab.experiments.experiment_pages import Outcome, experiment_page, index_page
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.known import missing_packages
from firmware_runtime.lab.experiments.trial import Say, Trial
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.view.page_file import why_no_pictures, write_page
from firmware_runtime.view.parts import Page

RESULTS, INDEX = "results.json", "index.html"
_STEP: Final = "firmware_runtime.lab.experiments.step_experiment:run_step"


def run_experiment(trial: Trial) -> Findings:
    """Run an experiment of either kind. Raises ConfigError, with the name of its function."""
    experiment = trial.experiment
    words = experiment.run if isinstance(experiment, OwnExperiment) else _STEP
    module, _, name = words.partition(":")
    try:
        found = getattr(import_module(module), name)(trial)
    except FirmwareRuntimeError:
        raise
    except Exception as error:
        said = f"{type(error).__name__}: {text_of(error)}"
        raise ConfigError.of_one(f"experiment {words}", f"{said}{_place(error)}") from error
    if not isinstance(found, Findings):
        said = f"returned {type(found).__name__}; expected Findings"
        raise ConfigError.of_one(f"experiment {words}", said)
    return found


def _place(error: Exception) -> str:
    """The file and line that raised it."""
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""


def write_experiment(trial: Trial) -> tuple[Outcome, list[str]]:
    """Run an experiment and write its files; return their names as well, the page's last.

    Raises ConfigError for one that failed, OSError for files that cannot be written.
    """
    findings, folder, name = run_experiment(trial), trial.folder, trial.name
    outcome = Outcome(name, trial.experiment, findings)
    texts = dict(_texts(trial, findings, outcome))
    for file, text in texts.items():
        (folder / file).write_text(text, "utf-8")
    plots = list(_write_plots(trial, findings))
    recordings = sorted(path.name for path in folder.glob(f"{name}*.recording*"))
    files = [*texts, *plots, *recordings]
    page = experiment_page(trial.board, trial.experiment, findings, files)
    write_page(page, folder / f"{name}.html")
    return outcome, [*files, f"{name}.html"]


def _texts(trial: Trial, findings: Findings, outcome: Outcome) -> Iterator[tuple[str, str]]:
    """Data and figures, by the names of their files."""
    for suffix, lines in findings.data.items():
        yield f"{_named(trial.name, suffix)}.csv", "".join(f"{line}\n" for line in lines)
    figures = {
        "experiment": trial.name,
        "board": trial.board.name,
        "title": trial.experiment.title,
        **outcome.entry(),
        **findings.details,
        "published": list(trial.experiment.published),
        "settings": list(trial.board.assignments),
        "conditions": system_conditions(),
    }
    yield f"{trial.name}.json", msgspec.json.format(msgspec.json.encode(figures)).decode() + "\n"


def _write_plots(trial: Trial, findings: Findings) -> Iterator[str]:
    """Write each plot as a picture, where pictures can be drawn, and yield its name."""
    if why_no_pictures():
        return
    for suffix, plot in findings.plots.items():
        name = f"{_named(trial.name, suffix)}.svg"
        write_page(Page(title=trial.experiment.title, parts=[plot]), trial.folder / name)
        yield name


def _named(name: str, suffix: str) -> str:
    return f"{name}-{suffix}" if suffix else name


def run_series(trials: Sequence[Trial], say: Say) -> list[Outcome]:
    """Run each and write its files; one that fails leaves none, and the next one is run.

    Those that lack packages are said first and not run. Raises ConfigError if that is all of them.
    """
    missing = {each.name: why for each in trials if (why := missing_packages(each.experiment))}
    runnable = [trial for trial in trials if trial.name not in missing]
    if not runnable:
        raise ConfigError("experiment", [f"{name}: {why}" for name, why in missing.items()])
    for name, why in missing.items():
        say(f"{name} will not be run: {why}")
    begin, done = monotonic(), dict[str, Outcome]()
    for number, trial in enumerate(runnable, 1):
        say(f"[{number}/{len(runnable)}] {trial.name}, {monotonic() - begin:.0f} s since the start")
        try:
            done[trial.name] = _tried(trial)
        except FirmwareRuntimeError as error:
            done[trial.name] = Outcome(trial.name, trial.experiment, fault=str(error))
            say(f"{trial.name} failed: {error}")
    return [
        done.get(each.name) or Outcome(each.name, each.experiment, not_run=missing[each.name])
        for each in trials
    ]


def _tried(trial: Trial) -> Outcome:
    """Run one in a folder of its own, so that nothing of it stays if it fails."""
    with TemporaryDirectory(prefix=f".{trial.name}-", dir=trial.folder) as own:
        outcome, _ = write_experiment(replace(trial, folder=Path(own)))
        for each in Path(own).iterdir():
            each.rename(trial.folder / each.name)
    return outcome


def write_series(series: Sequence[Outcome], board: str, folder: Path) -> list[str]:
    """Write the index and results.json beside the experiments' files; return their names."""
    document = {each.name: each.entry() for each in series}
    (folder / RESULTS).write_text(json.dumps(document, indent=1, allow_nan=False) + "\n")
    write_page(index_page(board, series), folder / INDEX)
    return [RESULTS, INDEX]


def series_lines(series: Sequence[Outcome]) -> Iterator[str]:
    """Experiments that failed and those that were not run, then the findings of each."""
    for each in series:
        if each.fault is not None:
            yield f"FAILED {each.name}: {each.fault}"
    for each in series:
        if each.not_run is not None:
            yield f"NOT RUN {each.name}: {each.not_run}"
    for each in series:
        if each.findings is not None:
            yield f"{each.name} ({each.experiment.figure or 'not published'})"
            yield from (f"  {line}" for line in sentences_of(each))


def sentences_of(outcome: Outcome) -> Sequence[str]:
    """Return the sentences of its findings; none of one that failed or was not run."""
    return () if outcome.findings is None else outcome.findings.sentences
