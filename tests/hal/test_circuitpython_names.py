"""CircuitPython's modules on a machine that is none: when ours stand in, and what they do."""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from firmware_runtime.hal.circuitpython import board, digitalio, micropython, pwmio
from firmware_runtime.hal.circuitpython.stand_ins import MODULES, StandIns

BLINKAS = "raise NotImplementedError('Board not supported')\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder first on the path; no module is imported, nor found by pytest's plugin.

    What a test imports under these names is gone after it.
    """
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(
        sys, "meta_path", [each for each in sys.meta_path if not isinstance(each, StandIns)]
    )
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name, raising=False)
    yield tmp_path
    for name in (*MODULES, "board.pins"):
        sys.modules.pop(name, None)


def test_ours_stand_in_where_there_are_none_and_are_gone_afterwards(folder: Path) -> None:
    assert folder.is_dir()
    with StandIns():
        assert import_module("board") is board
        assert import_module("busio").I2C.__module__ == MODULES["busio"]
        import_module("digitalio")
    assert digitalio.__spec__ is not None
    assert digitalio.__spec__.name == MODULES["digitalio"]  # by which it can be imported again
    assert "board" not in sys.modules
    with pytest.raises(ModuleNotFoundError):
        import_module("board")


def test_they_may_be_taken_away_before_the_block_ends(folder: Path) -> None:
    assert folder.is_dir()
    with StandIns() as stand_ins:
        import_module("board")
        stand_ins.remove()
        with pytest.raises(ModuleNotFoundError):
            import_module("board")


def test_a_board_of_the_users_own_is_left_alone(folder: Path) -> None:
    (folder / "board.py").write_text("mine = True\n")
    with StandIns():
        assert import_module("board").mine
    assert sys.modules["board"] is not board


def test_a_folder_of_the_users_own_is_left_alone(folder: Path) -> None:
    (folder / "board").mkdir()
    (folder / "board" / "pins.py").write_text("mine = True\n")
    with StandIns():
        assert import_module("board.pins").mine


def test_blinkas_is_replaced_unless_it_is_kept(folder: Path) -> None:
    (folder / "adafruit_blinka").mkdir()
    (folder / "board.py").write_text(BLINKAS)
    with StandIns():
        assert import_module("board") is board
    with StandIns(keep_blinka=True), pytest.raises(NotImplementedError):
        import_module("board")


def test_pins_are_their_names() -> None:
    assert (board.SCL, board.GPIO17) == ("SCL", "GPIO17")
    with pytest.raises(AttributeError, match="_private"):
        _ = board._private


def test_a_line_belongs_to_its_pin_and_follows_its_pull_where_nothing_drives_it() -> None:
    with digitalio.DigitalInOut("D5") as output:
        output.switch_to_output(value=True)
        seen = digitalio.DigitalInOut("D5")
        assert seen.value
        output.value = False
        assert not seen.value
    assert output.direction is digitalio.Direction.INPUT
    line = digitalio.DigitalInOut("D6")
    line.switch_to_input(pull=digitalio.Pull.UP)
    assert line.value


def test_a_pwm_pin_keeps_its_duty_until_it_is_let_go() -> None:
    pwm = pwmio.PWMOut("D7", duty_cycle=0x8000, frequency=50)
    assert (pwm.duty_cycle, pwm.frequency) == (0x8000, 50)
    pwm.deinit()
    assert pwm.duty_cycle == 0
    plain = pwmio.PWMOut("D8")
    assert (plain.duty_cycle, plain.frequency) == (0, 500), "as CircuitPython has it"


def test_words_for_micropythons_compiler_change_nothing() -> None:
    assert micropython.const(7) == 7
    assert micropython.native(len) is micropython.viper(len) is len
