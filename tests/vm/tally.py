"""What the guest's lines add up to."""

from pathlib import Path
from typing import Final

from tests.vm.commands import show

PASSED, FAILED, REMARK, END = "ok ", "FAILED ", "# ", "# all checks done"
SHOWN: Final = 60
"""Lines of each log that are shown when something failed."""


class Tally:
    """Counts checks, and shows each as it comes."""

    def __init__(self) -> None:
        self.passed = self.failed = 0
        self.is_complete = False

    def take(self, line: str) -> None:
        """Take one line of the guest."""
        self.passed += line.startswith(PASSED)
        self.failed += line.startswith(FAILED)
        self.is_complete |= line == END
        show(f"  {line}")

    @property
    def is_empty(self) -> bool:
        """Whether not one check was carried out."""
        return self.passed + self.failed == 0

    @property
    def has_passed(self) -> bool:
        """Whether the guest got through, and nothing failed."""
        return self.is_complete and self.failed == 0 and self.passed > 0

    def closing_line(self) -> str:
        """All of it in one line."""
        cut = "" if self.is_complete else "; the guest did not get through them"
        return f"{self.passed} passed, {self.failed} failed{cut}"

    def show_logs(self, folder: Path) -> None:
        """The last lines that guest and QEMU wrote, and where all of them are."""
        for log in sorted(folder.glob("*.log")):
            lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
            show(f"--- {log}, the last {min(len(lines), SHOWN)} of {len(lines)} lines")
            show("\n".join(lines[-SHOWN:]))
