"""What `python -m tests.machines` makes of interpreters and of what they found."""

import platform
import subprocess
import sys
from pathlib import Path

import pytest

from tests.machines.environments import _script
from tests.machines.functions import digests_of_the_library
from tests.machines.interpreters import Interpreter, interpreters
from tests.machines.matrix import Machine, matrix_of

MACHINES = [Machine("old", Path("old"), is_emulated=False), Machine("new", Path("new"), True)]


def finding(recording: str, **changed: object) -> dict[str, object]:
    same = {"differences": 0, "events": 10, "fields": 7, "first": None, "fault": None}
    return {"recording": recording, **same, **changed}


def test_the_matrix_has_a_row_for_who_recorded_and_a_column_for_who_replayed() -> None:
    of_old = [finding("old.a.recording"), finding("old.b.recording"), finding("new.a.recording")]
    of_new = [*of_old[:2], finding("new.a.recording", differences=3, first={"field": "x"})]
    head, old, new, counts = matrix_of(
        MACHINES, {"machines": [{"findings": of_old}, {"findings": of_new}]}
    ).splitlines()
    assert head.split()[-2:] == ["old", "new"]
    assert old.split() == ["old", "0", "of", "20", "0", "of", "20"]
    assert new.split() == ["new", "0", "of", "10", "3", "of", "10,", "1", "not", "identical"]
    assert counts == "6 replays, 60 output events and 42 fields compared"


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
