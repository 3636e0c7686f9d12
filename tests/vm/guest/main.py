"""All checks, one after the other, also across a reboot; then the machine is switched off."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tests.vm.guest import (
    adapter,
    contact,
    death,
    end,
    journal,
    network,
    overload,
    ros,
    service,
    setup,
)
from tests.vm.guest.machine import CARRIED, attempt
from tests.vm.guest.report import Check, carry_out, say

CHECKS: Final[tuple[Check, ...]] = (
    *setup.CHECKS,
    *adapter.CHECKS,
    *network.CHECKS,
    *contact.CHECKS,
    *service.CHECKS,
    *contact.BESIDE_A_RUN,
    *journal.CHECKS,
    *death.CHECKS,
    *overload.CHECKS,
    *service.TWO_ROBOTS,
    *end.CHECKS,
)
BY_NAME: Final[tuple[Check, ...]] = ros.CHECKS
"""Those that are carried out only where their module is named: they take minutes more."""
NEXT: Final = Path("/var/lib/vm-checks-next")
ONLY: Final = CARRIED / "only"
"""Names of modules of checks, where not all of them are wanted."""


def main() -> None:
    """Go on where the last boot ended."""
    begun = int(NEXT.read_text(encoding="ascii")) if NEXT.exists() else 0
    for number, check in enumerate(_wanted()[begun:], begun + 1):
        NEXT.write_text(str(number), encoding="ascii")
        carry_out(check)
    say("# all checks done")
    attempt("systemctl", "poweroff")


def _wanted() -> Sequence[Check]:
    """The checks of the modules that were named, after the set-up; all of CHECKS if none were."""
    names = ONLY.read_text(encoding="utf-8").split()
    if not names:
        return CHECKS
    known = (*CHECKS, *BY_NAME)
    return [each for each in known if each.__module__.split(".")[-1] in ("setup", *names)]


if __name__ == "__main__":
    main()
