"""The text file that node_exporter's textfile collector reads: whole, or the one before."""

from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_file import keep_file

MODE = 0o644
"""Readable by all users: the exporter runs as a user of its own."""


def write_textfile(path: Path, text: str) -> None:
    """Replace the file at once. Raises ConfigError when it cannot be written."""
    try:
        keep_file(path, text.encode(), MODE)
    except OSError as error:
        raise ConfigError(str(path), [f"cannot be written ({error.strerror})"]) from error
