"""A truth that says another place than the true one, for what judges it."""

from collections.abc import Callable

from sim_doubles.rigs.tachobot import TachobotRig

ASIDE = 9.0
"""Rad that its yaw is beside the true one: no healthy run was near."""


def truth_aside(
    is_aside: Callable[[TachobotRig], bool],
) -> Callable[[TachobotRig], dict[str, object]]:
    """Return a `truth` of the rig that is beside the true one whenever it is to be."""
    truth = TachobotRig.truth

    def told(rig: TachobotRig) -> dict[str, object]:
        aside = ASIDE if is_aside(rig) else 0.0
        said = truth(rig).items()
        return {name: each + aside if isinstance(each, float) else each for name, each in said}

    return told
