"""CircuitPython's `board` for a machine without pins: names of lines, and the bus at number 1."""

from sim_doubles.busio import I2C as _I2C

board_id = "SIM_DOUBLES"
SCL, SDA = "SCL", "SDA"


def I2C() -> _I2C:  # noqa: N802 -- CircuitPython's name
    """Open the bus that is plugged in at number 1."""
    return _I2C(SCL, SDA)


STEMMA_I2C = I2C


def __getattr__(name: str) -> str:
    """Any pin a driver asks for, D4 or GPIO17: its name."""
    if name.startswith("_"):
        raise AttributeError(f"board: no attribute {name!r}, expected I2C or the name of a pin")
    return name
