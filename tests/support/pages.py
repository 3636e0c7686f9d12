"""Programs and what they print, as pages of the documentation show them."""

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

PROJECT = Path(__file__).parents[2]
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)


class Example(NamedTuple):
    """A program, and the block of text right after it."""

    program: str
    output: str


def examples(page: str) -> list[Example]:
    """The Python blocks of `docs/PAGE` that are followed by a block of text."""
    text = (PROJECT / "docs" / page).read_text(encoding="utf-8")
    blocks = _BLOCK.findall(text)
    pairs = pairwise(blocks)
    return [
        Example(program, output)
        for (kind, program), (after, output) in pairs
        if (kind, after) == ("python", "text")
    ]


def printed(program: str, folder: Path = PROJECT) -> str:
    """What a program prints in a process of its own, in which warnings are errors."""
    words = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
