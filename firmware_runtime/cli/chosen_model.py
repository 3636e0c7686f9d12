"""The model that the command line names: a board's, a model file's, or an object of any module."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.cli.chosen_board import SUFFIX, chosen_board, is_model
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import ConfigError

if TYPE_CHECKING:
    from firmware_runtime.models.qss import System

ABOUT = "a board whose model takes event files, a FILE.ma, or MODULE:CLASS"
ANY = "any board, a FILE.ma, or MODULE:CLASS"


def chosen_model(word: str, assignments: Sequence[str] = ()) -> "Component | System":
    """The model that is meant; `assignments` change a board, or are arguments of the class.

    Raises ConfigError.
    """
    if not is_model(word):
        board = chosen_board(word, assignments)
        if board.event_model is None:
            raise ConfigError.of_one(board.name, "its model takes no event files", expected=ABOUT)
        return board.event_model(None)
    if not word.endswith(SUFFIX):
        # a run of a board starts without what models of other modules take
        from firmware_runtime.runs.named_model import named_model  # noqa: PLC0415

        return named_model(word, dict(_arguments(assignments)), ABOUT)
    if assignments:
        raise ConfigError.of_one(word, "--set changes a board or a class", expected="one of them")
    return _of_file(Path(word))


def devs_model(word: str, assignments: Sequence[str] = ()) -> Component:
    """As `chosen_model`; raises ConfigError for a quantized system too, which is no DEVS model."""
    model = chosen_model(word, assignments)
    if not isinstance(model, Component):
        raise ConfigError.of_one(word, f"it makes {type(model).__name__}", expected=ABOUT)
    return model


def print_warnings(path: Path, sentences: Sequence[str]) -> None:
    """Print what is odd in a file that was read all the same, on standard error."""
    for sentence in sentences:
        print(f"firmware-runtime: warning: {path}: {sentence}", file=sys.stderr)


def _of_file(path: Path) -> Component:
    """The model of a `.ma` file. Raises ConfigError."""
    # a run of a board starts without what model files take
    from firmware_runtime.ecdpp.atomic_class import known_classes  # noqa: PLC0415
    from firmware_runtime.ecdpp.file_text import Warnings  # noqa: PLC0415
    from firmware_runtime.ecdpp.model_file import read_model  # noqa: PLC0415

    model = read_model(path, known_classes(file=path), warnings := Warnings())
    print_warnings(path, warnings.sentences())
    return model


def _arguments(assignments: Iterable[str]) -> Iterator[tuple[str, object]]:
    """Names and values, which are TOML or else texts. Raises ConfigError."""
    from firmware_runtime.board.assignments import assigned  # noqa: PLC0415 -- as above

    for text in assignments:
        name, separator, _ = text.partition("=")
        if not (name.strip() and separator):
            raise ConfigError.of_one("--set", f"{text}: expected NAME=VALUE, such as period_s=0.5")
        yield assigned(text)
