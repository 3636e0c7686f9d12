"""`export`, `show`, and event files on models that belong to no board."""

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.detective.detective import MODEL_FILE

from tests.support import figure_6

TOP = Path(str(files("generator_buffer_processor"))) / "top.ma"
Command = Callable[..., Any]


@pytest.mark.slow
def test_a_board_exported_and_imported_again_plays_figure_6(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("figure6.ev").write_text(figure_6.EVENTS)
    assert command("export", "detective", "-o", "robot.ma").out == "robot.ma\n"
    assert command("export", "robot.ma", "-o", "figure_6_robot.py").out == "figure_6_robot.py\n"
    for model in ("robot.ma", "figure_6_robot:Top"):
        ended = command("run", model, "--events", "figure6.ev")
        assert (ended.status, ended.out, ended.error) == (0, figure_6.OUTPUTS, "")
    assert command("export", "figure_6_robot:Top").out == Path("robot.ma").read_text()


def test_a_folder_becomes_a_package(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command("export", TOP, "-o", "imported_gbp").status == 0
    ended = command("run", "imported_gbp:Top", "--events", TOP.with_name("jobs.ev"))
    assert ended.out == TOP.with_name("jobs.out").read_text()


def test_a_model_file_is_drawn(command: Command, tmp_path: Path) -> None:
    assert command("show", TOP, "-o", tmp_path / "top.svg").status == 0
    assert "BUF-PROC" in (tmp_path / "top.svg").read_text()


def test_a_model_file_has_a_tree(command: Command) -> None:
    assert "PROC" in command("show", TOP).out


def test_what_is_there_is_not_written_over(command: Command, tmp_path: Path) -> None:
    mine = tmp_path / "mine.py"
    mine.write_text("mine")
    (tmp_path / "package").mkdir()
    (tmp_path / "package/__init__.py").write_text("mine")
    for output in (mine, tmp_path / "package"):
        ended = command("export", MODEL_FILE, "-o", output)
        assert (ended.status, ended.out) == (2, "")
        assert "exists; expected a new file" in ended.error
    assert mine.read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("export", "tachobot"), "its model takes no event files"),
        (("export", "detective", "-o", "x.txt"), "expected a name that ends in .ma"),
        (("export", "no_such_module:Top"), "ModuleNotFoundError"),
        (("export", "builtins:dict"), "no signature found"),
        (("export", "firmware_boards.detective.detective:Nobody"), "has no Nobody"),
        (("export", "firmware_runtime:Atomic"), "an atomic model; expected a coupled one"),
        (("export", MODEL_FILE, "--set", "model.hop_s=1"), "--set: has no effect on a model file"),
        (("run", MODEL_FILE, "--stage", "simulation"), "leave --stage out"),
        (("export", "detective", "-o", "x.py"), "becomes no Python source; expected a FILE.ma"),
        (("export", MODEL_FILE, "--last", "3"), "--last: has no effect on a model"),
        (("export",), "no model; expected a board"),
        (("show", "--state", "a", "--whole"), "--state: has no effect here; expected it with -o"),
        (("export", "no/such.ma"), "cannot be read"),
        (("export", MODEL_FILE, "-o", "2nd.py"), "expected a name that Python can import"),
        (("export", MODEL_FILE, "-o", "/no/such/folder/x.py"), "expected a file that can be"),
    ],
)
def test_what_cannot_be_done_is_a_sentence(
    command: Command, words: tuple[str, ...], sentence: str
) -> None:
    ended = command(*words)
    assert (ended.status, ended.out) == (2, "")
    assert sentence in ended.error


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("#include(rules.inc)", "line 1: #include is not supported"),
        ("#macro(x)", "line 1: #macro is not supported"),
        ("[top]\ncomponents : c\n[c]\ntype : cell", "line 4: [c] is a grid of cells"),
    ],
)
def test_what_cd_plus_plus_has_and_this_has_not_is_refused_with_file_and_line(
    command: Command, tmp_path: Path, line: str, sentence: str
) -> None:
    path = tmp_path / "grid.ma"
    path.write_text(line)
    ended = command("export", path)
    assert ended.status == 2
    assert str(path) in ended.error
    assert sentence in ended.error
