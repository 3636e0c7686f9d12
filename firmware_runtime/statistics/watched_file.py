"""A statistics file that is read again and again, for a view that lives."""

from pathlib import Path

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.comparison import difference, same_run
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

QUIT, PAUSE = b"qQ\x03", b" "


class Watched:
    """A statistics file read again and again: as it is `now`, and what came `lately`.

    A run that ended goes on being shown; a new one is taken up when its file is there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.now: Statistics = read_statistics(path)
        self.lately: Statistics = self.now
        self.is_paused = False
        self.is_wanted = True

    def obey(self, key: bytes) -> None:
        """Do what a key is for; then, or without one, read unless paused."""
        self.is_wanted = key == b"" or key not in QUIT
        self.is_paused ^= key == PAUSE
        if not self.is_paused:
            self.read()

    def read(self) -> None:
        """Read once more; a file that cannot be read just now leaves everything as it was."""
        try:
            later = read_statistics(self._path)
        except StatisticsFileError:
            return
        self.lately = difference(later, self.now) if same_run(later, self.now) else later
        self.now = later
