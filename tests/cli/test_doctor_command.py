"""The real command on this machine, as the user of the tests and as nobody."""

import json
import os
import shutil
from collections.abc import Iterator
from importlib.metadata import distribution
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from firmware_runtime.cli.commands import doctor
from firmware_runtime.host.doctor.check import Check, Finding, Result, Severity, ok
from firmware_runtime.host.doctor.registry import GROUPS
from tests.support.command import Command, in_python

IDS = [check.id for checks in GROUPS.values() for check in checks]
NOBODY = 65534
FAKE = Check("supply", "it starves", "charge it", lambda _machine: ok("full"))


def worst_exit_status(report: dict[str, Any]) -> int:
    return {"failure": 8, "warning": 7}.get(report["worst"], 0)


@pytest.mark.parametrize("words", [[], ["tachobot"], ["detective"]])
def test_every_check_reports_itself_completely(command: Command, words: list[str]) -> None:
    ended = command("doctor", *words, "--json")
    report = json.loads(ended.out)
    assert ended.error == ""
    assert (report["schema"], [each["id"] for each in report["checks"]]) == (2, IDS)
    for each in report["checks"]:
        assert list(each) == ["id", "status", "seen", "why", "fix"]
        assert all(each.values())
    assert ended.status == worst_exit_status(report)


def test_the_report_for_people_is_grouped_and_counted(command: Command) -> None:
    ended = command("doctor")
    lines = ended.out.splitlines()
    assert [line for line in lines if line in GROUPS] == list(GROUPS)
    assert lines[-1].startswith(f"{len(IDS)} checks: ")
    assert all(any(f" {name} " in line for line in lines) for name in IDS)


def test_verbose_says_of_every_check_why(command: Command) -> None:
    brief, full = command("doctor").out, command("doctor", "--verbose").out
    assert brief.count("why: ") < full.count("why: ") == full.count("fix: ") == len(IDS)


@pytest.mark.parametrize(
    ("status", "exit_status"),
    [("not-applicable", 0), ("ok", 0), ("note", 0), ("warning", 7), ("failure", 8)],
)
def test_the_exit_status_is_that_of_the_worst_finding(
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    status: str,
    exit_status: int,
) -> None:
    results = [
        Result("supply", FAKE, finding)
        for finding in (ok("full"), Finding(Severity(status), "empty", "change it"))
    ]
    monkeypatch.setattr(doctor, "examine", lambda _machine: results)
    ended = command("doctor")
    assert ended.status == exit_status
    assert ("fix: change it" in ended.out) == (status in {"note", "warning", "failure"})
    assert json.loads(command("doctor", "--json").out)["worst"] in {status, "ok"}


def test_the_exit_statuses_are_in_the_help(command: Command) -> None:
    text = " ".join(command("doctor", "--help").out.split())
    assert "0 all well, or notes only; 7 a warning; 8 a failure" in text


BECOME_NOBODY = """
import contextlib, io, os, sys
from firmware_runtime.cli.main import main
with contextlib.redirect_stdout(io.StringIO()):
    main(sys.argv[2:])  # so that everything is imported while it may still be read
os.setgroups([])
os.setgid(int(sys.argv[1]))
os.setuid(int(sys.argv[1]))
sys.exit(main(sys.argv[2:]))
"""


@pytest.fixture
def everybodys_checkout() -> Iterator[Path]:
    """A copy of this project where every user may read it, wherever the checkout is."""
    checkout = Path(__file__).parents[2]
    with TemporaryDirectory() as name:
        copy = Path(name)
        copy.chmod(0o755)
        packages = ("firmware_runtime", "sim_doubles")
        for package in (*packages, "drivers/firmware_drivers", "boards/firmware_boards"):
            shutil.copytree(checkout / package, copy / Path(package).name)
        installed = copy / "firmware_runtime-0.dist-info"
        installed.mkdir()
        for part in ("METADATA", "entry_points.txt"):
            text = distribution("firmware-runtime").read_text(part)
            (installed / part).write_text(text or "", encoding="utf-8")
        yield copy


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_an_ordinary_user_gets_an_answer_to_every_check(
    everybodys_checkout: Path, tmp_path: Path
) -> None:
    ended = in_python(
        BECOME_NOBODY,
        NOBODY,
        "doctor",
        "tachobot",
        "--json",
        cwd=everybodys_checkout,
        env={**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path / "state")},
    )
    assert ended.stderr == ""
    report = json.loads(ended.stdout)
    assert len(report["checks"]) == len(IDS)
    assert ended.returncode == worst_exit_status(report)
