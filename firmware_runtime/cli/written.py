"""A text that a verb has made, into a file or to the screen."""

from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.whole_file import keep_file


def write_text(text: str, output: Path | None) -> None:
    """Write it whole and print where; without a place print the text. Raises ConfigError."""
    if output is None:
        print(text, end="")
        return
    try:
        keep_file(output, text.encode())
    except OSError as error:
        fault = f"{output}: {error.strerror}; expected a file that can be written"
        raise ConfigError.of_one("-o", fault) from error
    print(output)
