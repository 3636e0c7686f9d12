"""A world for trying a chip out: each of its quantities swings through half of its scale."""

import math
from typing import Final

from firmware_runtime.board.registers.register_table import Register, RegisterTable
from firmware_runtime.devs.time import SECOND
from sim_doubles.chips.register_table_double import World

PERIOD_S: Final = 10.0


def swinging(table: RegisterTable) -> World:
    """The quantities of a table, each to and fro about the middle of its scale."""

    def world(at: int) -> dict[str, float]:
        share = 0.5 + 0.25 * math.sin(math.tau * at / SECOND / PERIOD_S)
        return {str(each.quantity): _value(each, share) for each in table.quantities}

    return world


def _value(register: Register, share: float) -> float:
    counts = register.counts
    return register.value(round(counts[0] + share * (counts[-1] - counts[0])))
