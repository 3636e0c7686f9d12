"""`solve MODULE:SYSTEM`: a system of a user's module, as a table or a plot."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.models.qss import System, solve

FALL = System(
    states={"height": 10.0, "speed": 0.0}, equations={"height": "speed", "speed": "-9.81"}
)
NOTHING = 3


def make() -> System:
    """A system, when it is asked for."""
    return FALL


@pytest.mark.parametrize("name", ["FALL", "make"])
def test_the_table_has_what_solve_returns(capsys: pytest.CaptureFixture[str], name: str) -> None:
    assert main(["solve", f"{__name__}:{name}", "--until", "1", "--samples", "3"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    times, values = solve(FALL, 1.0, samples=3)
    assert head == "t_s,height,speed"
    expected = zip(times, values["height"], values["speed"], strict=True)
    assert [tuple(map(float, row.split(","))) for row in rows] == list(expected)


def test_method_and_quantum_are_those_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["solve", f"{__name__}:FALL", "--until", "1", "--samples", "2"]
    main([*words, "--method", "QSS1", "--quantum", "0.5"])
    rough = capsys.readouterr().out
    main(words)
    assert rough != capsys.readouterr().out


def test_files_are_a_table_or_a_plot(tmp_path: Path) -> None:
    for name in ("fall.csv", "fall.svg"):
        assert main(["solve", f"{__name__}:FALL", "--until", "1", "-o", str(tmp_path / name)]) == 0
    assert (tmp_path / "fall.csv").read_text().startswith("t_s,height,speed\n")
    assert "<polyline" in (tmp_path / "fall.svg").read_text()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["no_such_module:X", "--until", "1"], "ModuleNotFoundError"),
        ([f"{__name__}:NOTHING", "--until", "1"], "not callable"),
        ([__name__, "--until", "1"], "it names no object; expected MODULE:SYSTEM"),
        ([":FALL", "--until", "1"], "it names no module; expected MODULE:SYSTEM"),
        ([f"{__name__}:FALL", "--until", "-1"], "more than 0 s"),
        ([f"{__name__}:FALL", "--until", "1", "--samples", "1"], "2 to 10000000 samples"),
        ([f"{__name__}:FALL", "--until", "1", "--samples", "10000001"], "2 to 10000000 samples"),
        ([f"{__name__}:FALL", "--until", "1", "--quantum", "1e-300"], "quantum of height"),
        ([f"{__name__}:FALL", "--until", "1", "-o", "fall.pdf"], ".csv or .svg"),
    ],
)
def test_bad_input_is_one_sentence(
    capsys: pytest.CaptureFixture[str], words: list[str], fault: str
) -> None:
    assert main(["solve", *words]) == 2
    assert fault in capsys.readouterr().err
