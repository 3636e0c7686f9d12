"""Errors say where, what and what was expected, in one form of sentence, and as attributes."""

import copy
import pickle
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, sentence
from firmware_runtime.hal.wire_errors import NoAcknowledge


@pytest.mark.parametrize(
    ("where", "what", "expected", "said"),
    [
        ("i2c-1 0x40", "no answer", "a PCA9685", "i2c-1 0x40: no answer; expected a PCA9685"),
        ("", "no answer", "a PCA9685", "no answer; expected a PCA9685"),
        ("--for", "", "seconds", "--for: expected seconds"),
        ("--for", "no number", "", "--for: no number"),
        ("run", "did you mean x?", "one of x, y", "run: did you mean x? Expected one of x, y"),
        ("", "", "", ""),
    ],
)
def test_a_sentence_has_what_there_is_to_say(
    where: str, what: str, expected: str, said: str
) -> None:
    assert sentence(where, what, expected) == said
    error = FirmwareRuntimeError(what, where=where, expected=expected)
    assert (str(error), error.where, error.what, error.expected) == (said, where, what, expected)


def test_an_error_of_the_wire_is_the_built_in_too_and_survives_another_process() -> None:
    error = NoAcknowledge("no answer", where="i2c-1 0x40", expected="a PCA9685")
    assert isinstance(error, OSError)
    for each in (pickle.loads(pickle.dumps(error)), copy.copy(error)):  # noqa: S301 -- our own
        assert (str(each), each.where, each.expected) == (str(error), "i2c-1 0x40", "a PCA9685")


def test_an_error_of_one_fault_has_it_in_its_parts() -> None:
    error = ConfigError.of_one("--for", "no number", expected="seconds")
    assert (error.where, error.what, error.expected) == ("--for", "no number", "seconds")
    assert error.faults == ("no number; expected seconds",)
    assert str(error) == "--for: no number; expected seconds"


def test_an_error_of_many_faults_lists_them_all(tmp_path: Path) -> None:
    file = tmp_path / "board.toml"
    file.write_text('board = "tachobot"\n')
    with pytest.raises(ConfigError) as caught:
        registry.load(str(file))
    assert caught.value.where == str(file)
    assert len(caught.value.faults) > 1
    assert str(caught.value).splitlines()[1:] == [f"  - {each}" for each in caught.value.faults]
