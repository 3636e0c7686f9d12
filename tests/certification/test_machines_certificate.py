"""A certificate is a pass only if every machine replayed every recording, by one code, alike."""

import math
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from firmware_runtime.blackbox.header import Header
from firmware_runtime.certification.certificate import (
    Certificate,
    OfMachine,
    certificate_of,
    in_columns,
    merged,
    read_certificate,
)
from firmware_runtime.certification.finding import Finding, Place
from firmware_runtime.certification.found import finding_of_run
from firmware_runtime.certification.machine import Machine, this_machine
from firmware_runtime.certification.page import certificate_page, place_said
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.motion import Motion
from firmware_runtime.replay.difference import Difference
from firmware_runtime.replay.verdict import Verdict

FINDING = Finding(
    recording="flight.recording",
    sha256="ab" * 32,
    board="tachobot",
    made_with={"python": "CPython 3.11.7"},
    duration_s=10.0,
    events=923,
    fields=6680,
    differences=0,
    code_sha256="cd" * 32,
)
PLACE = Place(
    what="state",
    t_ns=780_000_000,
    model="controller.attitude",
    field="motion.position",
    recorded="0.1 (0x1.999999999999ap-4)",
    replayed="0.10000000000000002 (0x1.999999999999bp-4)",
    units_apart=1,
)
HEADER = Header(
    run="tachobot-1",
    board="tachobot",
    kind="tachobot",
    fingerprint="",
    source="",
    table={},
    role=None,
    has_world=True,
    clock="VirtualClock",
    speed=1.0,
    lines=[],
    early=[],
    ports=[],
    world=[],
    code={},
    code_sha256="",
    versions={},
)


def of(name: str, *findings: Finding) -> Certificate:
    machine = Machine(
        name=name,
        python="CPython 3.13.0",
        compiler="GCC",
        machine="aarch64",
        kernel="Linux",
        c_library="glibc 2.36",
        library_sha256="ef" * 32,
        packages={"numpy": "2.5.1"},
    )
    return Certificate(machines=[OfMachine(machine=machine, findings=list(findings))])


def test_machines_that_found_nothing_different_are_a_pass() -> None:
    both = merged([of("one", FINDING), of("other", FINDING)])
    assert both.is_identical
    assert [len(found) for _, found in in_columns(both)] == [2]
    assert "not identical" not in certificate_page(both)


@pytest.mark.parametrize(
    "changed",
    [
        {"differences": 1},
        {"first": PLACE},
        {"fault": "the file ends before the run did"},
        {"code_sha256": "00" * 32},
        {"sha256": "00" * 32},
    ],
)
def test_whatever_one_machine_finds_is_no_pass(changed: dict[str, Any]) -> None:
    both = merged([of("one", FINDING), of("other", replace(FINDING, **changed))])
    assert not both.is_identical
    assert "not identical" in certificate_page(both)
    assert any(both.lacking()) == bool({"code_sha256", "sha256"} & changed.keys())


def test_nothing_at_all_is_no_pass_nor_a_machine_that_did_not_run() -> None:
    assert not merged([]).is_identical
    absent = Certificate(machines=[], not_run={"qemu-aarch64": "no such program"})
    both = merged([of("one", FINDING), absent])
    assert not both.is_identical
    assert "no such program" in certificate_page(both)


def test_a_machine_that_is_in_two_certificates_is_one_column() -> None:
    second = replace(FINDING, recording="second", sha256="11" * 32)
    both = merged([of("one", FINDING), of("one", second), of("other", FINDING)])
    assert [each.machine.name for each in both.machines] == ["one", "other"]
    assert both.missing == [("other", "second")]
    assert [found[1] for _, found in in_columns(both)] == [FINDING, None]


def test_a_certificate_is_read_as_it_was_written(tmp_path: Path) -> None:
    both = merged([of("one", FINDING), of("other", replace(FINDING, first=PLACE))])
    path = tmp_path / "certificate.json"
    path.write_bytes(msgspec.json.encode(both.as_json()))
    assert read_certificate(path) == both
    for content in (b"{}", b"no JSON", b'{"format": 9, "machines": []}'):
        path.write_bytes(content)
        with pytest.raises(ConfigError, match="expected"):
            read_certificate(path)


def test_the_page_names_the_place_with_its_bits_and_escapes_what_a_file_says() -> None:
    odd = replace(FINDING, recording="<script>.recording", first=PLACE)
    page = certificate_page(of("one", odd))
    assert place_said(PLACE) in page
    assert "1 unit in the last place" in page
    assert "<script>" not in page


def test_the_first_difference_of_a_whole_run_is_named_to_the_bit() -> None:
    verdict = Verdict(events=5, steps=2, writes=3, duration=2_000_000_000)
    assert finding_of_run(HEADER, verdict, {}).is_identical
    values = Motion(0.1, 0.0), Motion(math.nextafter(0.1, 1.0), 0.0)
    verdict.differences, verdict.first = 1, Difference(7, "value", "attitude", "yaw", *values)
    found = finding_of_run(HEADER, verdict, {})
    assert found.first is not None
    assert not found.is_identical
    assert (found.first.name, found.first.units_apart) == ("attitude.yaw.position", 1)
    verdict.first = Difference(7, "state", "attitude", "_heading", 0.1, object())
    of_state = finding_of_run(HEADER, verdict, {}).first
    assert of_state is not None
    assert of_state.name == "attitude._heading"


def test_a_run_of_which_nothing_was_run_again_or_something_is_missing_is_no_pass() -> None:
    assert not finding_of_run(HEADER, Verdict(), {}).is_identical
    missing = Verdict(events=5, steps=2, faults=["a chunk is missing"])
    assert finding_of_run(HEADER, missing, {}).fault == "a chunk is missing"


def test_this_machine_is_described_and_survives_json() -> None:
    here = OfMachine(machine=this_machine(), findings=[])
    read = certificate_of(msgspec.json.encode(Certificate(machines=[here])))
    assert read.machines == [here]
    assert here.machine.machine in here.machine.name
