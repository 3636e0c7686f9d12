"""Recordings for the tests of what is seen."""

from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from tests.support.recorded import every_section


@pytest.fixture
def rewrite_from_keyframe() -> Callable[[Path, Path], None]:
    """Writes a recording without what came before its first keyframe."""

    def rewrite(source: Path, target: Path) -> None:
        chunk = read_recording(source).chunks[0]
        sections = every_section(source)
        first = next(place for place, each in enumerate(sections) if kind_of(each) == Kind.KEYFRAME)
        target.write_bytes(file_of([type(chunk)(9, [chunk.contents[0], *sections[first:]])]))

    return rewrite
