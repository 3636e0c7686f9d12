"""An experiment that a package's function runs: found by its words, called, and blamed."""

import traceback
from importlib import import_module

from firmware_runtime.board.experiments import OwnExperiment, StepExperiment
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Trial


def run_experiment(trial: Trial) -> Findings:
    """Run an experiment of either kind; return what it found. Raises ConfigError."""
    experiment = trial.experiment
    if isinstance(experiment, StepExperiment):
        return _called(trial, "firmware_runtime.lab.experiments.step_experiment:run_step")
    if isinstance(experiment, OwnExperiment):
        return _called(trial, experiment.run)
    raise TypeError(f"{experiment!r}: expected a StepExperiment or an OwnExperiment")


def _called(trial: Trial, words: str) -> Findings:
    """What a function of a package finds; whatever it raises is a sentence with its name."""
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
    """Where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({frames[-1].filename}:{frames[-1].lineno})" if frames else ""
