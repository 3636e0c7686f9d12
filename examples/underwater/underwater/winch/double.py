"""Double of the Winch. Source: example, rev. 1, as `registers.toml` has it.

Modelled: the table, and that CONTROL lets POWER through. Nothing of the driver's is used here.
Not modelled: the limit of the current, and how long a brake takes.
"""

from collections.abc import Callable
from importlib.resources import files
from typing import Final

from firmware_runtime.board.registers.register_file import load_table
from firmware_runtime.board.registers.register_table import Register
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.clock import Now
from sim_doubles.worlds.swinging import swinging

TABLE: Final = load_table(files("underwater.winch") / "registers.toml")


class WinchDouble(RegisterTableDouble):
    """A chip at `address`; `world` gives its quantities, constant or at an instant (ns).

    `before_change` is called just before its power changes, with the old power still there.
    """

    def __init__(
        self, now: Now, address: int = TABLE.addresses[0], world: World | None = None
    ) -> None:
        super().__init__(now, TABLE, address, world or swinging(TABLE))
        self.before_change: Callable[[], None] = lambda: None
        self.power = 0.0
        """Share of full voltage at the motor, -1 to 1."""
        self.is_on = False

    def written(self, register: Register, word: int) -> None:  # noqa: ARG002 -- what was kept of it counts
        """Let the motor follow POWER and CONTROL."""
        if register.name in {"CONTROL", "POWER"}:
            self.before_change()
            self.is_on = self.word("CONTROL") == 1
            power = int.from_bytes(bytes((self.word("POWER"),)), signed=True)
            self.power = power / 127 if self.is_on else 0.0

    def power_cycle(self) -> None:
        """Lose supply and get it back: the motor is off."""
        self.before_change()
        super().power_cycle()
        self.is_on, self.power = False, 0.0
