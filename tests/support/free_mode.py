"""Overrides that make TachoBot a hovering one: mode `free`, which has a second PCA9685."""

from typing import Final

FREE: Final = ("controller.mode=free", "esc.bus=i2c1", "esc.address=0x41")
