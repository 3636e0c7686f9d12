"""docs/service.md says of every check what the registry says, in the same order."""

import re
from pathlib import Path

from firmware_runtime.errors import Status
from firmware_runtime.host.doctor.check import Severity
from firmware_runtime.host.doctor.registry import GROUPS

SERVICE = (Path(__file__).parents[2] / "docs" / "service.md").read_text()
PAGE = SERVICE.partition("\n## What the doctor checks\n")[2].partition("\n## ")[0]
CHECKS = [check for checks in GROUPS.values() for check in checks]


def test_the_page_has_every_check_with_why_and_the_fix_in_order() -> None:
    rows = re.findall(r"^### (.*)$|^\| `([a-z0-9-]+)` \| (.*) \| `(.*)` \|$", PAGE, re.MULTILINE)
    expected = [
        row
        for group, checks in GROUPS.items()
        for row in ((group, "", "", ""), *(("", each.id, each.why, each.fix) for each in checks))
    ]
    stated = [(title.lower(), *(each.replace("\\|", "|") for each in row)) for title, *row in rows]
    assert stated == expected


def test_the_page_states_every_status() -> None:
    stated = dict(re.findall(r"^\| `([a-z-]+)` \|.*\| (\d) \|$", PAGE, flags=re.MULTILINE))
    exits = {Severity.WARNING: Status.DOCTOR_WARNS, Severity.FAILURE: Status.DOCTOR_FAILS}
    assert stated == {each: str(int(exits.get(each, Status.OK))) for each in Severity}


def test_there_are_enough_checks_and_each_has_a_name_of_its_own() -> None:
    names = [check.id for check in CHECKS]
    assert len(names) == len(set(names)) >= 20
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in names)
