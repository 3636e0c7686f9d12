"""The model that the command line names: a board's, a model file's, or a class of any module."""

import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.found_object import found_object
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import ConfigError

SUFFIX = ".ma"
ABOUT = "a board whose model takes event files, a FILE.ma, or MODULE:CLASS"
ANY = "any board, a FILE.ma, or MODULE:CLASS"


def is_model(word: str) -> bool:
    """Whether this is a model file, or a class of a module, rather than a board."""
    return word.endswith(SUFFIX) or (":" in word and not Path(word).exists())


def chosen_model(word: str, assignments: Sequence[str] = ()) -> Component:
    """The model that is meant; `assignments` change a board. Raises ConfigError."""
    if not is_model(word):
        board = chosen_board(word, assignments)
        if board.event_model is None:
            raise ConfigError.of_one(board.name, "its model takes no event files", expected=ABOUT)
        return board.event_model(None)
    if assignments:
        raise ConfigError.of_one(word, "--set changes a board", expected="a board")
    return _of_file(Path(word)) if word.endswith(SUFFIX) else found_object(word, Component, ABOUT)


def _of_file(path: Path) -> Component:
    """The model of a `.ma` file. Raises ConfigError."""
    # a run of a board starts without what model files take
    from firmware_runtime.ecdpp.atomic_class import known_classes  # noqa: PLC0415
    from firmware_runtime.ecdpp.file_text import Warnings  # noqa: PLC0415
    from firmware_runtime.ecdpp.model_file import read_model  # noqa: PLC0415

    model = read_model(path, known_classes(file=path), warnings := Warnings())
    print_warnings(path, warnings.sentences())
    return model


def print_warnings(path: Path, sentences: Sequence[str]) -> None:
    """Print what is odd in a file that was read all the same, on standard error."""
    for sentence in sentences:
        print(f"firmware-runtime: warning: {path}: {sentence}", file=sys.stderr)
