"""Stand-ins for the world at the edge: chips that answer byte by byte, plants that move.

A double has two faces. The bus face speaks the chip's own bytes, acknowledges and refuses as the
datasheet says; the world face speaks SI units to a plant. Time is injected and nothing sleeps: what
a chip does by itself is evaluated when it is looked at. What the real chip would not take as meant
is kept in `warnings`. A double never looks at a driver: each transcribes the datasheet on its own,
so that a wrong address shows.

For tests of other people's drivers: `plug` puts doubles behind a bus number, `sim_doubles.smbus`
and `sim_doubles.busio` open it, `sim_doubles.pytest_plugin` has it all as fixtures.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_doubles.plugged import plug as plug

__all__ = ["plug"]


def __getattr__(name: str) -> object:
    """`plug`, imported at first use: pytest imports this package in every session."""
    if name != "plug":
        raise AttributeError(f"module 'sim_doubles' has no attribute {name!r}")
    from sim_doubles.plugged import plug  # noqa: PLC0415 -- see above

    return plug
