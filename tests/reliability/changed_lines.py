"""Lines of code that were changed or added since a commit, as `git diff` counts them."""

import re
import subprocess
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Final

_FILE: Final = "+++ b/"
_HUNK: Final = re.compile(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@")


def changed_lines(root: Path, since: str) -> Mapping[str, set[int]]:
    """Return the numbers of the changed lines by file, committed or not.

    Raises ValueError for what is no commit.
    """
    shown = ["--unified=0", "--no-ext-diff", "--no-color", "--src-prefix=a/", "--dst-prefix=b/"]
    words = ["git", "-C", str(root), "diff", *shown, "--end-of-options", since, "--"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ValueError(f"{since!r}: git knows no such commit; expected one of this project")
    return read_diff(done.stdout)


def read_diff(text: str) -> Mapping[str, set[int]]:
    """Return the numbers of the lines that a diff without context adds, by file."""
    lines: dict[str, set[int]] = defaultdict(set)
    file = ""
    for line in text.splitlines():
        if line.startswith(_FILE):
            file = line.removeprefix(_FILE)
        elif (hunk := _HUNK.match(line)) is not None:
            begin, count = int(hunk[1]), int(hunk[2] or 1)
            lines[file].update(range(begin, begin + count))
    return lines
