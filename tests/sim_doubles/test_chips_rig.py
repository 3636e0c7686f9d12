"""Doubles of single chips: which words mean which, what cannot be, what they do on one bus."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError
from sim_doubles import chip_doubles
from sim_doubles.chip_doubles import chip_double, names
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from sim_doubles.rigs import singles
from sim_doubles.rigs.chips import BUS, ChipsRig, placed


def rig(*words: str) -> ChipsRig:
    return ChipsRig(placed(words), ManualClock())


def faults(*words: str) -> Sequence[str]:
    with pytest.raises(ConfigError) as refused:
        rig(*words)
    return refused.value.faults


@pytest.mark.parametrize("name", names())
def test_every_chip_has_a_usual_address_or_a_port(name: str) -> None:
    made = rig(name)
    address = chip_double(name).address
    if address is None:
        assert list(made.ports) == [name]
        assert made.buses == {}
    elif name != "ak8963":  # behind a closed bypass
        made.buses[BUS].read(address, 1)


@pytest.mark.parametrize("at", [0, SECOND, 4 * SECOND])
def test_what_turns_a_chip_without_a_robot_turns_its_field_alike(at: int) -> None:
    def angle(later: int) -> float:
        x, y, _ = singles._inertia(at + later).field
        return math.atan2(-y, x)

    rate = (angle(MILLISECOND) - angle(-MILLISECOND)) * SECOND / (2 * MILLISECOND)
    assert singles._inertia(at).rate[2] == pytest.approx(rate, abs=1e-6)


def test_what_samples_by_itself_is_up_to_now_before_its_world_changes() -> None:
    clock = ManualClock()
    made = ChipsRig(placed(["mpu9250"]), clock)
    chip, *_ = made.buses[BUS].targets
    assert isinstance(chip, Mpu9250Double)
    clock.advance(SECOND)
    assert chip.samples == 0
    made.catch_up()
    assert chip.samples > 0


def test_a_chip_can_be_at_another_address_beside_one_of_its_kind() -> None:
    bus = rig("pca9685", "pca9685@0x41", "mpu9250@105").buses[BUS]
    assert bus.write_read(0x41, b"\xfe", 1) == b"\x1e"
    assert bus.write_read(0x40, b"\xfe", 1) == b"\x1e"
    assert bus.write_read(0x69, b"\x75", 1) == b"\x71"


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["pca9865"], ["did you mean pca9685"]),
        (["mpu9250@zz"], ["'zz'"]),
        (["pca9685@0x80"], ["'0x80'"]),
        (["maxbotix@0x40"], ["no address"]),
        (["hmc5883l@0x20"], ["0x1e, which is fixed"]),
        (["ak8963@0x0d"], ["0x0c, which is fixed"]),
        (["pca9685@0x20"], ["expected 0x40 to 0x7f"]),
        (["pca9685", "pca9685"], ["0x40 is that of pca9685@0x40 already"]),
        (["pca9685", "h_bridge@64"], ["0x40"]),
        (["mpu9250", "ak8963"], ["comes with another chip, and 0x68 is that of mpu9250@0x68"]),
        (["ak8963", "mpu9250"], ["0x68 is that of the chip that comes with ak8963@0x0c"]),
        (["ak8963", "ak8963"], ["0x0c is that of ak8963@0x0c"]),
        (["maxbotix", "maxbotix"], ["given twice"]),
        (["x", "cmps12@", "md25@0"], ["--chip x", "--chip cmps12@", "--chip md25@0"]),
        (["hmc5883l@0x20", "md25", "md25"], ["hmc5883l", "0x58"]),
    ],
)
def test_what_cannot_be_is_refused_all_at_once(words: list[str], named: list[str]) -> None:
    found = faults(*words)
    assert len(found) == len(named)
    for fault, part in zip(found, named, strict=True):
        assert part in fault


NOW = ManualClock()


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: Md25Double(NOW, 0x60), "MD25: address is 0x60, expected 0x58 to 0x5f"),
        (
            lambda: Cmps12Double(NOW, 0x68, bearing_deg=lambda _: 0.0, noise_seed=None),
            "CMPS12: address is 0x68, expected 0x60 to 0x67",
        ),
        (
            lambda: Srf08Double(NOW, 0x60, echoes=lambda _: []),
            "SRF08: address is 0x60, expected 0x70 to 0x7f",
        ),
        (lambda: SabertoothDouble(NOW, 136), "Sabertooth: address is 0x88, expected 0x80 to 0x87"),
        *(
            (lambda at=at: Pca9685Double(NOW, at), "expected 0x40 to 0x7f without 0x70")
            for at in (0x3F, 0x70, 0x80)
        ),
        (
            lambda: MaxbotixDouble(NOW, lambda _: 1.0, family="hr"),
            r"family is 'hr', expected one of \['lv', 'xl', ",
        ),
    ],
)
def test_an_address_that_a_chip_cannot_have_is_refused(
    make: Callable[[], object], fault: str
) -> None:
    with pytest.raises(ValueError, match=fault):
        make()


def test_outputs_are_called_by_chip_and_output() -> None:
    made = rig("pca9685@0x41", "sabertooth", "mpu9250")
    bus = made.buses[BUS]
    for message in (b"\x00\x20", b"\x0e\x00\x00\x00\x08"):
        bus.write(0x41, message)
    levels = made.levels(0)
    assert len(levels) == 18
    assert {name for name, level in levels.items() if level} == {"pca9685@0x41.2"}
    assert levels["pca9685@0x41.2"] == 0.5
    assert made.outputs == {"pca9685@0x41": 1, "sabertooth": 0}
    assert made.next_change_at(0) == NEVER
    assert (made.enable, made.result(1, {})) == (None, {})


class EntryPoint(NamedTuple):
    name: str
    loaded: object
    value: str = "a_package:Double"

    def load(self) -> object:
        if isinstance(self.loaded, Exception):
            raise self.loaded
        return self.loaded


def making(made: object) -> object:
    return lambda _now, address=0x20: (address, made)[1]


@pytest.mark.parametrize(
    ("loaded", "named"),
    [
        *((making(made), "expected a Target or several") for made in (None, [], ["x"], "abc")),
        (ImportError(name="a_package"), "a_package:Double"),
        (lambda _now, address: address, "a_package:Double"),  # without a usual address
    ],
)
def test_an_entry_point_that_makes_no_target_or_is_no_double_is_refused(
    loaded: object, named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chip_doubles, "installed", lambda _: [EntryPoint("mine", loaded)])
    assert named in faults("mine")[0]
