"""A detective board file with the second choice of every chip that has one."""

from pathlib import Path

from firmware_runtime.board import installed as kinds

_MD25 = """driver = "md25"
bus = "i2c1"
address = 0x58
speed = 0.06
refresh_s = 0.5
acceleration = 10
full_counts_s = 1020.0       # encoder counts a second at full speed: wheels are checked by it"""
_CHANGES = (
    (
        _MD25,
        'driver = "sabertooth"\nport = "treads"\nspeed = 0.06\nrefresh_s = 0.1',
    ),
    (
        '"srf08"\nbus = "i2c1"\naddress = 0x75\nmax_range_m = 1.0\ngain = 16\nperiod_s = 0.066',
        '"maxbotix"\nport = "sonar"\nperiod_s = 0.2',
    ),
    ('chip = "cmps12"\nbus = "i2c1"\naddress = 0x62', 'chip = "hmc5883l"\nbus = "i2c1"'),
)


def second_choice_board(folder: Path) -> Path:
    """Write it: Sabertooth and MaxBotix on serial ports, an HMC5883L for the body's compass."""
    text = kinds.shipped_file("detective").read_text()
    for first, second in _CHANGES:
        assert first in text
        text = text.replace(first, second)
    for port in ("treads", "sonar"):
        text += f'\n[ports.{port}]\ndevice = "/dev/tty{port}"\nbaud = 9600\n'
    board = folder / "board.toml"
    board.write_text(text)
    return board
