"""docs/doctor.md says of every check what the registry says, in the same order."""

import re
from pathlib import Path

import pytest

from firmware_runtime.errors import Status
from firmware_runtime.host.doctor.check import Check
from firmware_runtime.host.doctor.finding import Severity
from firmware_runtime.host.doctor.registry import GROUPS

PAGE = (Path(__file__).parents[2] / "docs" / "doctor.md").read_text()
CHECKS = [check for checks in GROUPS.values() for check in checks]


def test_the_page_has_every_check_in_order() -> None:
    titles = re.findall(r"^##+ (.*)$", PAGE, flags=re.MULTILINE)
    assert [title.lower() for title in titles] == [
        name for group, checks in GROUPS.items() for name in (group, *(each.id for each in checks))
    ]


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: str(check.id))
def test_the_page_has_why_and_the_fix(check: Check) -> None:
    section = PAGE.partition(f"### {check.id}\n")[2].partition("\n#")[0]
    why, _, fix = section.strip().partition("\n\n")
    assert " ".join(why.split()) == check.why
    assert fix == f"    {check.fix}"


def test_the_page_states_every_status() -> None:
    stated = dict(re.findall(r"^\| `([a-z-]+)` \|.*\| (\d) \|$", PAGE, flags=re.MULTILINE))
    exits = {Severity.WARNING: Status.DOCTOR_WARNS, Severity.FAILURE: Status.DOCTOR_FAILS}
    assert stated == {each: str(int(exits.get(each, Status.OK))) for each in Severity}


def test_there_are_enough_checks_and_each_has_a_name_of_its_own() -> None:
    names = [check.id for check in CHECKS]
    assert len(names) == len(set(names)) >= 20
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in names)
