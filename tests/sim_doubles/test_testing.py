"""What tests ask their buses for and cannot have; the page on testing."""

import re
import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, SettingError
from sim_doubles.clock import ManualClock
from sim_doubles.faults import (
    AdapterError,
    BrownOut,
    Fault,
    FaultScript,
    FlippedBit,
    ForcedRegister,
    NackAddress,
    NackByte,
)
from sim_doubles.testing.buses import TestBuses
from sim_doubles.testing.chips import LEVEL
from tests.support.pytest_in_a_folder import run_pytest


def test_a_second_chip_at_one_address_is_refused() -> None:
    buses = TestBuses(ManualClock(SECOND))
    try:
        buses.connect("pca9685", 0x40)
        buses.connect("pca9685", 0x41)
        buses.connect("pca9685", 0x40, bus=3)
        with pytest.raises(ConfigError, match="0x40 on i2c-1"):
            buses.connect("pca9685", 0x40)
        assert len(buses.bus(1).targets) == 2
    finally:
        buses.end()


@pytest.mark.parametrize("bus", [-1, 1.0, None, True])
def test_a_bus_is_a_number_or_a_path(bus: object) -> None:
    with pytest.raises(ConfigError):
        TestBuses(ManualClock()).bus(bus)  # type: ignore[arg-type]


def test_an_address_that_is_text_is_refused() -> None:
    with pytest.raises(ConfigError):
        TestBuses(ManualClock(SECOND)).connect("pca9685", "0x40")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("chip", "settings", "keys"),
    [
        ("srf08", {"echoes": 3}, ["echoes"]),
        ("cmps12", {"bearing_deg": "west", "version": 1.5}, ["bearing_deg", "version"]),
        ("hmc5883l", {"field": (1e-6, 2e-6)}, ["field"]),
        ("mpu9250", {"inertia": 9.81}, ["inertia"]),
        ("pca9685", {"name": 3}, ["name"]),
        ("ads1115", {"address": 0x80}, ["address 0x80"]),
    ],
)
def test_what_a_double_cannot_be_is_refused_by_its_name(
    chip: str, settings: dict[str, Any], keys: list[str]
) -> None:
    with pytest.raises(ConfigError) as refused:
        TestBuses(ManualClock(SECOND)).connect(chip, **settings)
    faults = refused.value.faults
    assert all(fault.startswith(key) for fault, key in zip(faults, keys, strict=True))


@pytest.mark.parametrize(
    ("chip", "settings"),
    [
        ("srf08", {"echoes": np.array([0.8])}),
        ("srf08", {"echoes": lambda _at: [0.8]}),
        ("hmc5883l", {"field": (np.float64(1e-6), 0, 0.0)}),
        ("mpu9250", {"inertia": LEVEL}),
    ],
)
def test_what_a_double_senses_may_come_from_numpy_or_a_function(
    chip: str, settings: dict[str, Any]
) -> None:
    buses = TestBuses(ManualClock(SECOND))
    try:
        assert buses.connect(chip, **settings) in buses.bus(1).targets
    finally:
        buses.end()


@pytest.mark.parametrize(
    ("make", "named"),
    [
        *(
            (partial(NackAddress, **stated), f"NackAddress: {[*stated][-1]}")
            for stated in (
                *({"address": "x"}, {"address": 0x80}, {"times": -1}, {"times": True}),
                *({"first": 3, "last": 1}, {"since": 0.5}, {"since": 5, "until": 4}),
            )
        ),
        (lambda: FlippedBit(index=0, bit=8), "bit"),
        (lambda: NackByte(index=-1), "index"),
        (lambda: ForcedRegister(register=0x100, value=0), "register"),
        (lambda: AdapterError(errno=0), "errno"),
        (lambda: BrownOut(target=3), "target"),  # type: ignore[arg-type]
    ],
)
def test_a_fault_that_could_not_strike_is_refused_by_the_name_of_its_setting(
    make: Callable[[], Fault], named: str
) -> None:
    with pytest.raises(SettingError, match=named):
        make()


def test_a_fault_script_takes_faults_alone() -> None:
    script = FaultScript([NackAddress()])
    for no_fault in (3, NackAddress):
        with pytest.raises(TypeError):
            script.add(no_fault)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        FaultScript([None])  # type: ignore[list-item]


PAGE = Path(__file__).parents[2] / "docs" / "testing.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```", PAGE.read_text("utf-8"))


FAILING = """
from smbus2 import SMBus

def test_log(i2c_double, i2c_log):
    i2c_double("pca9685")
    SMBus(1).read_byte_data(0x40, 0)
    assert i2c_log == ["0x40 W 00, R 10"]

def test_warning(i2c_double, no_protocol_warning):
    i2c_double("pca9685")
    SMBus(1).write_byte_data(0x40, 0, 0x01)
    SMBus(1).write_byte_data(0x40, 0xFE, 3)
"""
TIMED = 'def test_it(board, assert_timing):\n    assert_timing(board("tachobot"), skips=0)\n'


@pytest.mark.slow
def test_in_a_package_of_ones_own_the_ten_lines_pass_and_failures_show_log_and_warnings(
    tmp_path: Path,
) -> None:
    """A limit that cannot be told is skipped; with a setting of pytest, every one is strict."""
    lines = blocks("python")[0]
    assert len(lines.splitlines()) == 10
    for name, content in (("ten_lines", lines), ("failing", FAILING), ("timed", TIMED)):
        (tmp_path / f"test_{name}.py").write_text(content)
    done = run_pytest(tmp_path, "-W", "error", "-rA")
    shown = [line.strip().removeprefix("E").strip() for line in done.stdout.splitlines()]
    ended = {line for line in shown if line.startswith("PASSED ")}
    assert {line.partition("::")[0] for line in ended} == {"PASSED test_ten_lines.py"}
    assert {"-0x40 W 00, R 10", "+0x40 W 00, R 11"} <= {*shown}
    assert any("PRE_SCALE" in line for line in shown)
    assert shown[-1].startswith("2 failed, 1 passed, 1 skipped")
    (tmp_path / "pytest.ini").write_text("[pytest]\nstrict_timing = true\n")
    strict = run_pytest(tmp_path, "-W", "error", "test_timed.py").stdout
    assert "1 failed" in strict.splitlines()[-1]
    assert "in virtual time" in strict


@pytest.mark.slow
def test_what_it_says_without_pytest_prints_the_prescaler(
    capsys: pytest.CaptureFixture[str],
) -> None:
    exec(compile(blocks("python")[2], str(PAGE), "exec"), {})  # noqa: S102 -- the page's own
    assert capsys.readouterr().out == "30\n"


@pytest.mark.slow
def test_the_workflows_runs_end_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = re.findall(r"- run: (firmware-runtime .*)", blocks("yaml")[0])
    assert len(commands) == 3
    monkeypatch.chdir(tmp_path)
    for command in commands:
        _, *arguments = shlex.split(command.replace("--for 60", "--for 1"))
        assert main(arguments) == 0, command
    assert (tmp_path / "timing.html").stat().st_size > 10_000
