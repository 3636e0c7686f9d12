"""Which program units start, and how programs of the system are called."""

import sys
from pathlib import Path

import pytest

from firmware_runtime.errors import InstallationRefused, StepFailed
from firmware_runtime.host.installation import target as programs_of_units
from firmware_runtime.host.installation.plan import PROGRAM
from firmware_runtime.host.installation.target import (
    answer,
    checked,
    own_program,
    refuse_hidden,
    run,
    runnable,
)
from tests.support.recorded_programs import RecordedPrograms

SHELL = "/bin/sh"


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RecordedPrograms:
    recorded = RecordedPrograms(tmp_path / "bin")
    monkeypatch.setenv("PATH", str(recorded.directory))
    return recorded


@pytest.mark.parametrize("place", ["/home/pi", "/root", "/run/user/1000"])
def test_a_program_that_a_service_would_not_see_is_refused(place: str) -> None:
    with pytest.raises(InstallationRefused, match="hidden from a service; install it into"):
        checked(f"{place}/venv/bin/firmware-runtime")


@pytest.mark.parametrize("program", ["firmware-runtime", "/opt/my robot/run", "/opt/a\nb", ""])
def test_a_program_that_cannot_stand_in_a_unit_is_refused(program: str) -> None:
    with pytest.raises(InstallationRefused, match="cannot stand in a unit"):
        checked(program)


def test_a_name_that_only_begins_like_a_hidden_place_is_none() -> None:
    refuse_hidden([Path("/homes/firmware-runtime"), Path("/rooted")])


def test_a_program_must_be_there() -> None:
    with pytest.raises(InstallationRefused, match="/opt/none: is no program that can be run"):
        runnable("/opt/none")
    assert runnable(SHELL) == SHELL


def test_an_interpreter_in_a_hidden_place_is_refused_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/home/pi/python/bin/python3")
    with pytest.raises(InstallationRefused, match=r"lies below /(home|root|tmp)"):
        own_program(Path("/usr/lib/rover/definition.py"))


def test_a_board_whose_package_a_service_would_not_see_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(programs_of_units, "HIDDEN", ("/home",))
    with pytest.raises(InstallationRefused, match="/home/pi/rover"):
        own_program(Path("/home/pi/rover/rover/definition.py"))


def test_this_program_is_found_beside_its_interpreter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(programs_of_units, "HIDDEN", ())
    program = Path(own_program(Path("/usr/lib/rover/definition.py")))
    assert program.name == Path(PROGRAM).name
    assert program.parent == Path(sys.executable).parent


def test_a_command_is_shown_and_run(programs: RecordedPrograms) -> None:
    programs.add("systemctl")
    reported: list[str] = []
    run(("systemctl", "enable", "a b"), reported.append)
    assert reported == ["$ systemctl enable 'a b'"]
    assert programs.calls == ["systemctl enable a b"]


def test_what_a_command_prints_is_its_answer(programs: RecordedPrograms) -> None:
    programs.add("systemctl", out="ActiveState=active\n")
    assert answer(("systemctl", "show")) == "ActiveState=active\n"


def test_a_failing_command_is_explained_in_one_sentence(programs: RecordedPrograms) -> None:
    programs.add("systemctl", error="Job failed.\nSee the journal.\n", status=4)
    with pytest.raises(StepFailed) as raised:
        run(("systemctl", "start", "x"), lambda _: None)
    expected = "systemctl start x: ended with status 4: Job failed. See the journal."
    assert str(raised.value) == expected


def test_a_command_that_is_not_there_is_explained(programs: RecordedPrograms) -> None:
    with pytest.raises(StepFailed, match=r"udevadm: cannot be run .* expected it on the path"):
        run(("udevadm", "trigger"), lambda _: None)
    assert programs.calls == []
