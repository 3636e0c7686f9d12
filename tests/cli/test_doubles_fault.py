"""`doubles fault`: what it lets fail, for how long, and what it refuses."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.served.client import ServedDoubles, strike
from firmware_runtime.hal.served.packets import Strike
from firmware_runtime.hal.wire_errors import BusAbsent, BusTimeout, NoAcknowledge
from tests.support.served_rig import served_rig


def test_one_chip_fails_for_its_time_and_the_log_has_it(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("tachobot", log=log) as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        strike(rig.ask, Strike("i2c1", 121, SECOND, 0x68))
        with pytest.raises(NoAcknowledge):
            bus.transaction(0x68, (b"\x75", 1))
        assert bus.transaction(0x40, (b"\xfe", 1)) == b"\x1e"
        rig.clock.advance(SECOND + 1)
        assert bus.transaction(0x68, (b"\x75", 1)) == b"\x71"
    faults = [json.loads(line) for line in log.read_text().splitlines() if "fault" in line]
    assert [(each["address"], each["until_ns"]) for each in faults] == [(0x68, SECOND)]


def test_without_an_address_the_whole_bus_fails() -> None:
    with served_rig("detective") as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        strike(rig.ask, Strike("i2c1", 110, SECOND))
        for address in (0x40, 0x58, 0x73):
            with pytest.raises(BusTimeout):
                bus.transaction(address, (b"\x00", 1))


def test_without_a_bus_all_fail_whatever_they_are_called(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("detective", log=log) as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        strike(rig.ask, Strike("", 110, SECOND))
        with pytest.raises(BusTimeout):
            bus.transaction(0x40, (b"\x00", 1))
    (fault,) = [json.loads(line) for line in log.read_text().splitlines() if "fault" in line]
    assert fault["bus"] == "i2c1"


def test_a_bus_that_is_not_there_cannot_fail() -> None:
    with served_rig("tachobot") as rig, pytest.raises(BusAbsent, match="i2c7"):
        strike(rig.ask, Strike("i2c7", 110, SECOND))


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["melt", "--socket", "x"], "expected one of"),
        (["stuck"], "--socket"),
        (["stuck", "--socket", "x", "--address", "0x80"], "expected an address such as 0x40"),
        (["stuck", "--socket", "x", "--for", "0"], "expected a positive number"),
    ],
)
def test_bad_words_are_refused(command: Callable[..., Any], words: list[str], what: str) -> None:
    ended = command("doubles", "fault", *words)
    assert (ended.status, ended.out) == (2, "")
    assert what in ended.error


def test_where_nothing_is_served_there_is_one_sentence(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    ended = command("doubles", "fault", "stuck", "--socket", str(tmp_path / "none"))
    assert (ended.status, ended.out) == (3, "")
    assert "no doubles are served here" in ended.error
