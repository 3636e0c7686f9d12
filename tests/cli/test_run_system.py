"""`run MODULE:SYSTEM`: a quantized system of a user's module, as a table or a plot."""

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
    assert main(["run", f"{__name__}:{name}", "--for", "1", "--samples", "3"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    times, values = solve(FALL, 1.0, samples=3)
    assert head == "t_s,height,speed"
    expected = zip(times, values["height"], values["speed"], strict=True)
    assert [tuple(map(float, row.split(","))) for row in rows] == list(expected)


def test_method_and_quantum_are_those_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", f"{__name__}:FALL", "--for", "1", "--samples", "2"]
    main([*words, "--set", "method=QSS1", "--set", "quantum=0.5"])
    rough = capsys.readouterr().out
    main(words)
    assert rough != capsys.readouterr().out


def test_files_are_a_table_or_a_plot(tmp_path: Path) -> None:
    files = ["--outputs", str(tmp_path / "fall.csv"), "--plot", str(tmp_path / "fall.svg")]
    assert main(["run", f"{__name__}:FALL", "--for", "1", *files]) == 0
    assert (tmp_path / "fall.csv").read_text().startswith("t_s,height,speed\n")
    assert "<polyline" in (tmp_path / "fall.svg").read_text()


SYSTEM = f"{__name__}:FALL"


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["no_such_module:X"], "ModuleNotFoundError"),
        ([f"{__name__}:NOTHING"], "not callable"),
        ([f"{__name__}:FALLS"], "has no FALLS; did you mean FALL?"),
        ([f"{__name__}:"], "it names no object; expected a board"),
        ([":FALL"], "it names no module; expected a board"),
        ([SYSTEM, "--for", "-1"], "expected a positive number"),
        ([SYSTEM, "--samples", "1"], "expected a whole number from 2"),
        ([SYSTEM, "--samples", "10000001"], "2 to 10000000 samples"),
        ([SYSTEM, "--set", "quantum=1e-300"], "quantum of height"),
        ([SYSTEM, "--set", "quantums=1"], "did you mean quantum?"),
        ([SYSTEM, "--plot", "fall.pdf"], "ends in .svg"),
        ([SYSTEM, "--json"], "--json: has no effect"),
        ([SYSTEM, "--clock", "monotonic"], "--clock monotonic: has no effect"),
        ([SYSTEM, "--doubles"], "leave --doubles out"),
    ],
)
def test_bad_input_is_one_sentence(
    capsys: pytest.CaptureFixture[str], words: list[str], fault: str
) -> None:
    try:
        status = main(["run", *words])
    except SystemExit as exit_:
        status = int(exit_.code or 0)
    assert (status, fault in capsys.readouterr().err) == (2, True)
