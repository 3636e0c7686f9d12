from collections.abc import Callable
from pathlib import Path

import pytest

MODEL = """\
from firmware_runtime import MILLISECOND, Atomic


class Worker(Atomic):
    def __init__(self) -> None:
        super().__init__("worker")

    def initialize(self) -> None:
        self.hold_in("works", MILLISECOND)

    def internal(self) -> None:
        for _ in range({turns}):
            pass
        self.hold_in("works", MILLISECOND)


class Idle(Atomic):
    def __init__(self) -> None:
        super().__init__("idle")


class Broken(Worker):
    def internal(self) -> None:
        raise ValueError("no such thing")
"""


@pytest.fixture
def version(tmp_path: Path) -> Callable[[str, int], Path]:
    """Writes a folder with a model whose step takes so many turns of a loop."""

    def written(name: str, turns: int) -> Path:
        folder = tmp_path / name
        folder.mkdir()
        (folder / "gated.py").write_text(MODEL.format(turns=turns))
        return folder

    return written
