"""Which statistics file a verb reads: a board's, the latest of all, or one that was put aside."""

import argparse
import os
from pathlib import Path

from firmware_runtime.statistics.paths import SUFFIX, find_statistics


def add_kept(verb: argparse.ArgumentParser) -> None:
    """Add BOARD or FILE."""
    verb.add_argument(
        "kept",
        metavar="BOARD|FILE",
        nargs="?",
        help=f"a board's name, or a statistics file (FILE{SUFFIX}); default: whatever ran last",
    )


def path_of(kept: str | None) -> Path:
    """The file that is meant. Raises StatisticsFileError when a board has left none."""
    if kept is not None and (os.sep in kept or kept.endswith(SUFFIX)):
        return Path(kept)
    return find_statistics(kept)
