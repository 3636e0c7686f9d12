"""What `python -m tests.machines` makes of interpreters and of what they found."""

import platform
import subprocess
import sys
from pathlib import Path

import pytest

from tests.machines.environments import _script
from tests.machines.functions import digests_of_the_library
from tests.machines.interpreters import Interpreter, interpreters
from tests.machines.matrix import is_same, matrix_of


def verdict(**changed: object) -> dict[str, object]:
    same = {"identical": True, "differences": 0, "events": 10, "transfers": 7, "code_changed": []}
    return {**same, **changed}


def test_the_matrix_has_a_row_for_who_recorded_and_a_column_for_who_replayed() -> None:
    of_old = dict.fromkeys(("old.a.recording", "old.b.recording", "new.a.recording"), verdict())
    of_new = {**of_old, "new.a.recording": verdict(differences=3, identical=False)}
    head, old, new, counts = matrix_of({"old": of_old, "new": of_new}).splitlines()
    assert head.split()[-2:] == ["old", "new"]
    assert old.split() == ["old", "0", "of", "20", "0", "of", "20"]
    assert new.split() == ["new", "0", "of", "10", "3", "of", "10,", "1", "not", "identical"]
    assert counts == "6 replays, 60 values and 42 transfers compared"


@pytest.mark.parametrize("changed", [{"code_changed": ["x"]}, {"identical": None}])
def test_other_code_and_what_was_not_wholly_compared_are_not_the_same(
    changed: dict[str, object],
) -> None:
    assert is_same(verdict())
    assert not is_same(verdict(**changed))


@pytest.mark.slow
def test_the_interpreter_of_this_test_is_among_those_of_this_computer(tmp_path: Path) -> None:
    found = list(interpreters(tmp_path, [f"cpython-{platform.python_version()}-"]))
    assert [each.version for each in found if isinstance(each, Interpreter)][:1] == [
        platform.python_version()
    ]


def test_the_program_of_an_environment_is_its_interpreter_s_own_name(tmp_path: Path) -> None:
    command = ("-a", "$0", sys.executable)
    interpreter = Interpreter("here", "3", "x86_64", tmp_path, command, "A_VARIABLE=1")
    program = tmp_path / "python"
    program.write_text(_script(interpreter))
    program.chmod(0o755)
    shown = "import os, sys; print(sys.orig_argv[0], os.environ['A_VARIABLE'])"
    said = subprocess.run([program, "-S", "-c", shown], capture_output=True, text=True, check=True)
    assert said.stdout.split() == [str(program), "1"]


def test_digests_of_the_library_are_repeatable_and_tell_functions_apart() -> None:
    once = digests_of_the_library(50)
    assert once == digests_of_the_library(50)
    assert len({once[name] for name in ("sin", "cos", "exp", "square by **", "sum")}) == 5
