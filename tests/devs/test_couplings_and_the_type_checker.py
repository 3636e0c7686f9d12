"""What mypy says of couplings, before anything runs."""

import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]

MODELS = """
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled


class Text(str):
    pass


class Model(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.number_in = self.in_port("number_in", int)
        self.number_out = self.out_port("number_out", int)
        self.string_in = self.in_port("string_in", str)
        self.string_out = self.out_port("string_out", str)
        self.text_in = self.in_port("text_in", Text)
        self.text_out = self.out_port("text_out", Text)

    def output(self) -> None:
        {output}


top = Coupled("top")
number = top.in_port("number", int)
text = top.out_port("text", Text)
a = top.add(Model("a"))
b = top.add(Model("b"))
{couplings}
"""

RIGHT = """
top.couple(a.number_out, b.number_in)
top.couple(a.text_out, b.string_in)
top.couple(number, a.number_in)
top.couple(b.text_out, text)
"""

WRONG = [
    "top.couple(a.number_out, b.string_in)",
    "top.couple(a.string_out, b.text_in)",
    "top.couple(number, a.string_in)",
    "top.couple(a.number_out, text)",
    "top.couple(a.number_out, 'number_in')",
]


def errors_of_mypy(path: Path, couplings: str, output: str) -> list[str]:
    path.write_text(MODELS.format(couplings=couplings, output=output))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(path)],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
    )
    return [line for line in done.stdout.splitlines() if ": error: " in line]


@pytest.mark.slow
def test_mypy_accepts_right_couplings_and_refuses_each_wrong_one(tmp_path: Path) -> None:
    assert errors_of_mypy(tmp_path / "right.py", RIGHT, "self.number_out.send(1)") == []
    errors = errors_of_mypy(tmp_path / "wrong.py", "\n".join(WRONG), "self.number_out.send('1')")
    first = MODELS.split("{couplings}", maxsplit=1)[0].count("\n") + 1
    sent = MODELS.split("{output}", maxsplit=1)[0].count("\n") + 1
    lines = [int(error.split(":")[1]) for error in errors]
    assert lines == [sent, *range(first, first + len(WRONG))]
