"""The line at the OE pins of a board's doubles, here and served."""

import errno
from pathlib import Path

import pytest

from firmware_runtime.hal.served.client import ServedEnableLine
from firmware_runtime.hal.served.packets import Enable, Failed, Question, encode, read_answer
from firmware_runtime.hal.wire_errors import AddressInUse, BusAbsent, PortClosed
from sim_doubles.rigs.tachobot import TachobotRig
from tests.support.served_rig import ServedRig, lines_of, served_rig

WIRED = ("output_enable.chip=/dev/gpiochip0", "output_enable.line=17")
FULL_ON = (b"\xfd\x00", b"\xfb\x10")


def drive(rig: ServedRig) -> None:
    """Wake the chip and switch all its outputs full-on."""
    bus = rig.doubles.buses["i2c1"]
    for message in (b"\x00\x21", *FULL_ON):
        bus.transaction(0x40, (message,))


def duty(rig: ServedRig) -> float:
    assert isinstance(rig.doubles, TachobotRig)
    return rig.doubles.thrust.duty(0)


def test_outputs_are_off_until_the_line_lets_them_through_and_when_it_is_given_up() -> None:
    with served_rig("tachobot", *WIRED) as rig:
        line = rig.doubles.enable
        assert line is not None
        drive(rig)
        assert duty(rig) == 0
        line.set(True)
        assert duty(rig) == 1
        line.set(False)
        assert duty(rig) == 0
        line.set(True)
        line.close()
        assert duty(rig) == 0
        with pytest.raises(PortClosed):
            line.set(True)


def test_without_one_outputs_need_none() -> None:
    with served_rig("tachobot") as rig:
        drive(rig)
        assert (rig.doubles.enable, duty(rig)) == (None, 1)
        with pytest.raises(BusAbsent):
            ServedEnableLine("output_enable", rig.ask).set(True)


def test_a_client_that_goes_frees_the_line_and_the_log_has_it(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("tachobot", *WIRED, log=log) as rig:
        drive(rig)
        rig.service.answer(encode(Question(1, Enable(enabled=True))), client=3)
        assert duty(rig) == 1
        rig.service.release(4)
        assert duty(rig) == 1
        rig.service.release(3)
        assert duty(rig) == 0
    changes = [line["value"] for line in lines_of(log) if line.get("output") == "thrust_pairs.0"]
    assert changes == [1, 0]


def test_a_line_that_another_client_holds_is_refused_until_it_goes() -> None:
    with served_rig("tachobot", *WIRED) as rig:
        rig.service.answer(encode(Question(1, Enable(enabled=True))), client=3)
        asked = encode(Question(2, Enable(enabled=False)))
        assert read_answer(rig.service.answer(asked, client=4)).answered == Failed(errno.EBUSY)
        with pytest.raises(AddressInUse):
            ServedEnableLine("output_enable", rig.ask).set(False)
        rig.service.release(3)
        ServedEnableLine("output_enable", rig.ask).set(False)
