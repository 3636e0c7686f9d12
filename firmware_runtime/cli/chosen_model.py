"""The model that the command line names: a board's, a model file's, or a class of any module."""

import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of

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
            raise ConfigError.of_one(
                board.name, f"its model takes no event files; expected {ABOUT}"
            )
        return board.event_model(None)
    if assignments:
        raise ConfigError.of_one(word, "--set changes a board; expected a board")
    return _of_file(Path(word)) if word.endswith(SUFFIX) else _of_module(word)


def _of_file(path: Path) -> Component:
    """The model of a `.ma` file. Raises ConfigError."""
    # a run of a board starts without what model files take
    from firmware_runtime.ecdpp.class_catalogue import known_classes  # noqa: PLC0415
    from firmware_runtime.ecdpp.model_file import read_model  # noqa: PLC0415

    return read_model(path, known_classes())


def _of_module(word: str) -> Component:
    """The model that a module's class makes, or that a module has. Raises ConfigError."""
    module_name, _, name = word.partition(":")
    sys.path.insert(0, "")  # a user's module lies where the user is
    try:
        found = getattr(import_module(module_name), name)
        model = found if isinstance(found, Component) else found()
    except FirmwareRuntimeError:
        raise
    except (Exception, SystemExit) as error:
        fault = f"{type(error).__name__}: {text_of(error)}; expected {ABOUT}"
        raise ConfigError.of_one(word, fault) from error
    finally:
        sys.path.remove("")
    if not isinstance(model, Component):
        fault = f"it makes {type(model).__name__}; expected a model"
        raise ConfigError.of_one(word, fault)
    return model
