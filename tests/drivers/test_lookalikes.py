"""Parts that answer like a chip and are none: refused by the bring-up, or by every reading.

The table in docs/safety.md says which of both, for every chip.
"""

from collections.abc import Callable, Iterable, Mapping

import pytest
from firmware_drivers.chips.ads1115 import Ads1115
from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.srf08 import SHIPPED_AT, Srf08
from firmware_drivers.chips.step import Step
from firmware_drivers.sonar import Sonar, SonarSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge, NotReady, Stuck, WrongDevice
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.lookalikes import BusyRam, Eeprom, ReadOnly, RegisterRam
from tests.support.virtual_bus import VirtualBus
from tests.support.wire import take


class Lookalike:
    """A part on a bus, on a clock that only waits move."""

    def __init__(self, kind: type[RegisterRam], address: int, holds: Mapping[int, int]) -> None:
        self.clock = ManualClock()
        self.bus = I2cBusDouble("i2c1", self.clock, [kind(self.clock, address, holds)])

    def take(self, steps: Iterable[Step]) -> None:
        take(self.clock, steps)


# A sonar ------------------------------------------------------------------------------------------

ANSWERS = "not an SRF08: it answers 10 ms after a ranging command; expected silence for 64 ms"
KEEPS = "not an SRF08: registers 0 to 3 read 51 1f ff 00 after a ranging; expected revision 0a"


@pytest.mark.parametrize(
    ("kind", "error", "sentence"),
    [
        (RegisterRam, WrongDevice, ANSWERS),
        (ReadOnly, WrongDevice, ANSWERS),
        (BusyRam, WrongDevice, KEEPS),
        (Eeprom, NoAcknowledge, "no answer to a ranging command"),
    ],
)
def test_a_memory_is_no_sonar(
    kind: type[RegisterRam], error: type[HalError], sentence: str
) -> None:
    lookalike = Lookalike(kind, SHIPPED_AT, {0: 10})
    with pytest.raises(error, match=f"SRF08 at 0x70 on i2c1: {sentence}"):
        lookalike.take(Srf08(lookalike.bus).bring_up())


def test_one_that_keeps_the_command_is_none_at_the_next_bring_up_either() -> None:
    lookalike = Lookalike(BusyRam, SHIPPED_AT, {0: 0x51})
    for _ in range(3):
        with pytest.raises(WrongDevice, match="registers 0 to 3 read 51 1f ff 00"):
            lookalike.take(Srf08(lookalike.bus).bring_up())


@pytest.mark.parametrize("byte", range(256))
def test_what_reads_the_same_everywhere_is_no_sonar(byte: int) -> None:
    lookalike = Lookalike(ReadOnly, SHIPPED_AT, dict.fromkeys(range(256), byte))
    with pytest.raises(WrongDevice):
        lookalike.take(Srf08(lookalike.bus).bring_up())


@pytest.mark.parametrize("kind", [RegisterRam, ReadOnly, BusyRam, Eeprom])
def test_no_distance_comes_from_a_memory(kind: type[RegisterRam]) -> None:
    rig = VirtualBus()
    rig.connect(kind, address=SHIPPED_AT, holds={0: 10})
    settings = SonarSettings(period=100 * MILLISECOND, threshold_m=1.0)
    sonar = Sonar("sonar", Srf08(rig.bus), settings)
    distances = rig.simulate([sonar], sonar.distance_out)
    rig.send(sonar.start, 1, 0)
    rig.run(10 * SECOND)
    assert distances == []
    assert sonar.unready() == "is not up yet"


# Other chips --------------------------------------------------------------------------------------


H43 = {10: ord("H"), 11: ord("4"), 12: ord("3")}


@pytest.mark.parametrize(
    ("address", "holds", "steps", "sentence"),
    [
        (0x40, {}, lambda bus: Pca9685(bus).bring_up(50.0), "LED0_OFF_H reads 00 after full-off"),
        (0x48, {}, lambda bus: Ads1115(bus).bring_up(), "with no conversion begun"),
        (0x1E, H43, lambda bus: Hmc5883l(bus).bring_up(), "expected 02 or 03, a measurement done"),
        (0x0C, {0: 0x48}, lambda bus: Ak8963(bus).bring_up(), "expected three factors"),
    ],
)
def test_a_memory_with_the_identity_of_a_chip_is_refused(
    address: int,
    holds: Mapping[int, int],
    steps: Callable[[I2cBus], Iterable[Step]],
    sentence: str,
) -> None:
    lookalike = Lookalike(RegisterRam, address, holds)
    with pytest.raises((WrongDevice, NotReady), match=sentence):
        lookalike.take(steps(lookalike.bus))


def test_a_memory_with_the_identity_of_an_mpu9250_never_has_a_sample() -> None:
    lookalike = Lookalike(RegisterRam, 0x68, {0x75: 0x71})
    chip = Mpu9250(lookalike.bus)
    lookalike.take(chip.bring_up())
    for _ in range(100):
        with pytest.raises(NotReady):
            chip.read_sample()


def test_a_memory_with_a_bearing_is_a_compass_that_stands_still() -> None:
    lookalike = Lookalike(RegisterRam, 0x60, {0: 1})
    chip = Cmps12(lookalike.bus, period_ns=50 * MILLISECOND)
    lookalike.take(chip.bring_up())
    assert {chip.read_bearing().bearing_deg for _ in range(19)} == {0.0}
    with pytest.raises(Stuck):
        chip.read_bearing()


def test_a_memory_in_place_of_an_md25_has_no_battery_and_never_turns() -> None:
    lookalike = Lookalike(RegisterRam, 0x58, {13: 1, 14: 5})
    chip = Md25(lookalike.bus)
    lookalike.take(chip.bring_up())
    reports = {chip.set_speeds(0.5, 0.5) for _ in range(10)}
    assert {(report.left_encoder, report.battery_v) for report in reports} == {(0, 0.0)}
