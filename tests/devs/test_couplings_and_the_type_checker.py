"""Couplings that mypy accepts and others that it refuses, before anything runs.

`make types` is the test: a wrong line that mypy accepted would have a comment that is not used,
which strict mypy refuses too.
"""

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError


class Text(str):
    __slots__ = ()


class Model(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.number_in = self.in_port("number_in", int)
        self.number_out = self.out_port("number_out", int)
        self.string_in = self.in_port("string_in", str)
        self.string_out = self.out_port("string_out", str)
        self.text_in = self.in_port("text_in", Text)
        self.text_out = self.out_port("text_out", Text)

    def right_output(self) -> None:
        self.number_out.send(1)

    def wrong_output(self) -> None:
        self.number_out.send("1")  # type: ignore[arg-type]


class Whole(Coupled):
    def __init__(self) -> None:
        super().__init__("whole")
        self.number = self.in_port("number", int)
        self.text = self.out_port("text", Text)
        self.a = self.add(Model("a"))
        self.b = self.add(Model("b"))


def test_right_couplings_are_taken() -> None:
    whole = Whole()
    a, b = whole.a, whole.b
    whole.couple(a.number_out, b.number_in)
    whole.couple(a.text_out, b.string_in)
    whole.couple(whole.number, a.number_in)
    whole.couple(b.text_out, whole.text)


def test_wrong_couplings_are_refused_when_they_run_too() -> None:
    whole = Whole()
    a, b = whole.a, whole.b
    with pytest.raises(ModelError):
        whole.couple(a.number_out, b.string_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.string_out, b.text_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(whole.number, a.string_in)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.number_out, whole.text)  # type: ignore[misc]
    with pytest.raises(ModelError):
        whole.couple(a.number_out, "number_in")  # type: ignore[arg-type]
