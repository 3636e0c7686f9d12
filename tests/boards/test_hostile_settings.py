"""Whatever a board's file or an argument holds, it is refused in a sentence or taken; no more."""

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.local_settings import load_table
from firmware_runtime.board.registry import Board
from firmware_runtime.board.strict import DEEPEST, key_path
from firmware_runtime.errors import ConfigError

DEEP = 3000
BROKEN = {
    "lists": "[" * DEEP,
    "closed lists": "x = " + "[" * DEEP + "]" * DEEP,
    "tables": "x = " + "{a = " * DEEP + "1" + "}" * DEEP,
    "dotted keys": "world." + "a." * DEEP + "b = 1",
    "dotted headers": f"[world{'.a' * DEEP}]\nb = 1",
    "a long number": "x = " + "1" * 5000,
    "a long number in hexadecimal": "board = 0x" + "f" * 5000,
    "a long text": "board = '" + "x" * 100_000 + "'",
}
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**6000), 10**6000)
    | st.floats()
    | st.text(max_size=20)
)
TREES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


def keys_of(table: dict[str, Any], before: str = "") -> list[str]:
    """Every key of a board's file, dotted; a name with dots of its own is in quotes."""
    found: list[str] = []
    for name, value in table.items():
        key = f'{before}"{name}"' if "." in name else f"{before}{name}"
        inner = keys_of(value, f"{key}.") if isinstance(value, dict) else []
        found += [key, *inner]
    return found


KEYS = {name: keys_of(dict(registry.load(name).table)) for name in kinds.names()}
NUMBERS = st.integers().map(str) | st.floats().map(repr)
WORDS = st.text(st.characters(exclude_characters="\0"), max_size=20)


def refused_or_taken(load: Callable[[], Board]) -> None:
    """What a caller of `load` can bear: a board, or a ConfigError."""
    with suppress(ConfigError):
        load()


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN.keys())
def test_a_file_without_end_is_a_fault(tmp_path: Path, text: str) -> None:
    (tmp_path / "board.toml").write_text(text)
    with pytest.raises(ConfigError) as caught:
        registry.load(str(tmp_path))
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    "assignment",
    [
        "imu.mounting=" + "[" * DEEP,
        "imu.mounting=" + "[" * DEEP + "]" * DEEP,
        "imu.mounting=" + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1),
        "output_enable" + ".line" * DEEP + "=1",
        "imu.address=0x" + "f" * 5000,
        "imu.mounting=\udcff",
        "imu\udcff=1",
    ],
)
def test_an_override_without_end_or_of_no_text_is_a_fault(assignment: str) -> None:
    with pytest.raises(ConfigError) as caught:
        registry.load("tachobot", [assignment])
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("board", "why"),
    [
        ("x" * 5000, "unknown board"),
        ("x" * 5000 + ".toml", "File name too long"),
        ("nothing.toml", "no such file"),
        ("a\0.toml", "no name of a file"),
        ("a\ud800.toml", "no name of a file"),
        (os.devnull, "no regular file"),
    ],
)
def test_what_is_no_board_file_is_said(board: str, why: str) -> None:
    with pytest.raises(ConfigError) as caught:
        registry.load(board)
    assert why in str(caught.value)


@pytest.mark.parametrize("depth", [DEEPEST + 1, DEEP])
def test_kept_settings_without_end_are_a_fault(tmp_path: Path, depth: int) -> None:
    kept = tmp_path / "tachobot.settings"
    kept.write_text('{"world": ' + "[" * depth + "]" * depth + "}")
    with pytest.raises(ConfigError):
        load_table(kept)


@pytest.mark.slow
@settings(max_examples=25)
@given(st.text() | st.binary().map(lambda raw: raw.decode("utf-8", "surrogateescape")))
def test_any_override_is_refused_or_taken(assignment: str) -> None:
    refused_or_taken(lambda: registry.load("tachobot", [assignment]))


@pytest.mark.slow
@settings(max_examples=25)
@given(
    st.sampled_from([(name, key) for name, keys in KEYS.items() for key in keys]),
    NUMBERS | WORDS | st.lists(NUMBERS).map(lambda each: f"[{','.join(each)}]"),
)
def test_any_value_of_any_key_is_refused_or_taken(where: tuple[str, str], value: str) -> None:
    name, key = where
    refused_or_taken(lambda: registry.load(name, [f"{key}={value}"]))


@pytest.mark.slow
@settings(max_examples=25)
@given(st.sampled_from([(n, key) for n, keys in KEYS.items() for key in keys]), TREES)
def test_any_tree_in_kept_settings_is_refused_or_taken(
    tmp_path_factory: pytest.TempPathFactory, where: tuple[str, str], value: object
) -> None:
    name, key = where
    table = json.loads(json.dumps(dict(registry.load(name).table)))
    *parents, leaf = key_path(key)
    inner = table
    for parent in parents:
        inner = inner[parent]
    inner[leaf] = value
    kept = tmp_path_factory.mktemp("kept") / "kept.settings"
    try:
        kept.write_text(json.dumps(table))
    except ValueError:  # an integer that Python does not print: nor does a run
        return
    refused_or_taken(lambda: load_table(kept))
