"""A text that a verb has made, into a file or to the screen."""

import os
from collections.abc import Collection
from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_file import keep_output


def check_output(output: Path, suffixes: Collection[str]) -> None:
    """Raise ConfigError for a file of no known kind, or in no folder that takes it."""
    if output.suffix not in suffixes:
        fault = f"{output}: expected a name that ends in {' or '.join(suffixes)}"
        raise ConfigError("-o", [fault])
    if not os.access(output.parent, os.W_OK):
        fault = f"{output}: no folder that can be written; expected one"
        raise ConfigError("-o", [fault])


def write_text(text: str, output: Path | None) -> None:
    """Write it whole and print where; without a place print the text. Raises ConfigError."""
    if output is None:
        print(text, end="")
        return
    keep_output(output, text.encode())
    print(output)
