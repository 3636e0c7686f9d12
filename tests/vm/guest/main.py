"""All checks, one after the other, also across a reboot; then the machine is switched off."""

from pathlib import Path
from typing import Final

from tests.vm.guest import adapter, contact, death, end, journal, overload, service, setup
from tests.vm.guest.machine import attempt
from tests.vm.guest.report import Check, carry_out, say

CHECKS: Final[tuple[Check, ...]] = (
    *setup.CHECKS,
    *adapter.CHECKS,
    *contact.CHECKS,
    *service.CHECKS,
    *contact.BESIDE_A_RUN,
    *journal.CHECKS,
    *death.CHECKS,
    *overload.CHECKS,
    *service.TWO_ROBOTS,
    *end.CHECKS,
)
NEXT: Final = Path("/var/lib/vm-checks-next")


def main() -> None:
    """Go on where the last boot ended."""
    begun = int(NEXT.read_text(encoding="ascii")) if NEXT.exists() else 0
    for number, check in enumerate(CHECKS[begun:], begun + 1):
        NEXT.write_text(str(number), encoding="ascii")
        carry_out(check)
    say("# all checks done")
    attempt("systemctl", "poweroff")


if __name__ == "__main__":
    main()
