"""All checks, one after the other; with ARMED_MINUTES those of a long time armed instead."""

import sys
from typing import Final

from tests.pi.guest import detective, endurance, registers, tachobot
from tests.pi.guest.emulated import MINUTES, TIMEOUT_MS, started
from tests.vm.guest.report import Check, carry_out

SHORT: Final[tuple[Check, ...]] = (*registers.CHECKS, *tachobot.CHECKS, *detective.CHECKS)


def main() -> None:
    """Carry them out; each says how it went."""
    started(sys.executable, "-m", "tests.pi.guest.hand", TIMEOUT_MS, log="hand")
    for check in endurance.CHECKS if MINUTES else SHORT:
        carry_out(check)


if __name__ == "__main__":
    main()
