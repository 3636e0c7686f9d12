"""All checks, one after the other."""

from tests.pi.guest import registers, robot
from tests.vm.guest.report import carry_out


def main() -> None:
    """Carry them out; each says how it went."""
    for check in (*registers.CHECKS, *robot.CHECKS):
        carry_out(check)


if __name__ == "__main__":
    main()
