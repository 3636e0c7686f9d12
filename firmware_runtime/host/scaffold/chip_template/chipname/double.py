"""Double of the CHIP_PRINTED. Source: CHIP_SOURCE, as `registers.toml` has it.

Modelled: the table: power-up values, access, reserved addresses, side effects, quantities.
Not modelled: what the table does not say. What follows from a write belongs into `written`.
"""

from importlib.resources import files
from typing import Final

from firmware_runtime.board.registers.register_file import load_table
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.clock import Now
from sim_doubles.worlds.swinging import swinging

TABLE: Final = load_table(files("chipname") / "registers.toml")


class ChipNameDouble(RegisterTableDouble):
    """A chip at `address`; `world` gives its quantities, constant or at an instant (ns).

    Without a world they swing through half of their scales.
    """

    def __init__(
        self, now: Now, address: int = TABLE.addresses[0], world: World | None = None
    ) -> None:
        super().__init__(now, TABLE, address, world or swinging(TABLE))
