"""Gains and limits on a page: what may be set, what it would have done in the last run, a copy."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from firmware_runtime.board import registry
from firmware_runtime.board.board_file import Value, as_toml
from firmware_runtime.board.board_file import changed as text_with
from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.local_settings import settings_in_force
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import retunable_values, settings_with
from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.recording.blackbox.listing import span_of
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import settings_said
from firmware_runtime.recording.what_if.checkout import ask
from firmware_runtime.recording.what_if.what_if import Question
from firmware_runtime.recording.what_if.what_if_report import what_if_page
from firmware_runtime.statistics.units import unit_of
from firmware_runtime.system.atomic_file import read_text
from firmware_runtime.view.parts import Part, Text

LAST_S: Final = 60.0
"""Time of the run, up to its end, that is tried on."""
_PLOTS: Final = 4


def sliders(board: Board, values: Mapping[str, object]) -> list[dict[str, Any]]:
    """The keys that may change while the robot runs, with these values, ranges and meanings.

    `default` is what the board's settings have; keys that `values` leaves out are left out.
    """
    own = retunable_values(board.settings, board.retunable)
    return [
        {
            "key": key,
            "value": values[key],
            "default": own.get(key),
            "type": each.type,
            "least": each.above if each.least is None else each.least,
            "most": each.below if each.most is None else each.most,
            "range": each.range,
            "unit": unit_of(key),
            "text": each.text,
        }
        for key, each in described(board.settings, board.retunable).items()
        if key in values
    ]


def trial(recording: Path, changes: Mapping[str, object], last_s: float = LAST_S) -> list[Part]:
    """What these values would have sent in the end of a recorded run. Raises ConfigError.

    It is found out in a process of its own, so that this one goes on serving.
    """
    if not changes:
        raise ConfigError.of_one("try", "nothing is set otherwise", expected="another value")
    _, end = span_of(read_recording(recording))
    question = Question(
        recording=str(recording.absolute()),
        assignments=[f"{key}={as_toml(checked(key, value))}" for key, value in changes.items()],
        begin=max(0, end - round(last_s * SECOND)),
        plots=_PLOTS,
    )
    found = ask(question, None)
    changed = settings_said(found.settings_changed)
    page = what_if_page(found, changed)
    said = Text(text=f"With {changed}, in {found.duration_s:.3f} s of the run.")
    return [said, *page.opening, *page.parts]


def board_file(board: Board, values: Mapping[str, object], source: Path | None = None) -> str:
    """A board.toml as it is, comments too, but for these values. Raises ConfigError.

    The file is `source` if that is one; else the settings in force of a robot of that name, or what
    is shipped for its kind.
    """
    own = retunable_values(board.settings, board.retunable)
    for key in values:
        if key not in own:
            raise ConfigError.of_one(key, f"no such gain or limit{did_you_mean(key, list(own))}")
    settings_with(board, values)  # refuses what the file would be refused for
    path = _file_of(board, source)
    stated = registry.load(str(path)).settings
    in_file = retunable_values(stated, board.retunable)
    checked_values = {key: checked(key, value) for key, value in values.items()}
    differing = {key: value for key, value in checked_values.items() if in_file.get(key) != value}
    return text_with(read_text(path), differing)


def checked(key: str, value: object) -> Value:
    """A value that a board.toml can have at a key. Raises ConfigError."""
    is_finite = not isinstance(value, float) or value - value == 0.0
    if isinstance(value, bool | int | float | str) and is_finite:
        return value
    raise ConfigError.of_one(key, repr(value)[:40], expected="a finite number, true, false, a text")


def _file_of(board: Board, source: Path | None) -> Path:
    if source is not None and source.suffix == ".toml" and source.is_file():
        return source
    return settings_in_force(board.name) or shipped_file(board.kind)
