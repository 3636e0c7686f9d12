"""The text file that node_exporter's textfile collector reads: whole, or the one before."""

import os
from pathlib import Path

from firmware_runtime.errors import BoardError

MODE = 0o644
"""Anybody may read it: the exporter runs as a user of its own."""


def write_textfile(path: Path, text: str) -> None:
    """Replace the file at once. Raises BoardError when it cannot be written."""
    unfinished = path.parent / f".{path.name}.{os.getpid()}"
    try:
        unfinished.write_text(text)
        unfinished.chmod(MODE)
        unfinished.replace(path)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise BoardError(str(path), [f"cannot be written ({error.strerror})"]) from error
