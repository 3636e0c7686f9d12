"""Run pytest in a folder of its own, as another package does."""

import subprocess
import sys
from pathlib import Path


def run_pytest(folder: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    """Return how it ended and what it printed."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
