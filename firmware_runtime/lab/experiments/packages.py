"""Packages that an experiment needs: which are missing here, and the command that installs them."""

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, version

from firmware_runtime.board.experiments import Experiment

_NAME = re.compile(r"[\w.-]+")


def missing_packages(experiment: Experiment) -> str | None:
    """Which packages it lacks in this environment and what installs them, or None for none."""
    missing = [each for each in experiment.packages if not _is_installed(each)]
    if not missing:
        return None
    command = shlex.join([sys.executable, "-m", "pip", "install", *missing])
    return f"not installed: {', '.join(missing)}; expected {command}"


def _is_installed(package: str) -> bool:
    """Whether any version of it is there."""
    found = _NAME.match(package)
    try:
        version(package if found is None else found[0])
    except PackageNotFoundError:
        return False
    return True
