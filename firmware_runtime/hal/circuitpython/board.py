"""CircuitPython's `board` for a machine without pins: names of lines, and the bus of `busio`."""

from importlib import import_module

board_id = "SIM_DOUBLES"
SCL, SDA = "SCL", "SDA"


def I2C() -> object:  # noqa: N802 -- CircuitPython's name
    """Open the bus of whatever `busio` is in force."""
    return import_module("busio").I2C(SCL, SDA)


STEMMA_I2C = I2C


def __getattr__(name: str) -> str:
    """Any pin a driver asks for, D4 or GPIO17: its name."""
    if name.startswith("_"):
        raise AttributeError(f"board: no attribute {name!r}, expected I2C or the name of a pin")
    return name
