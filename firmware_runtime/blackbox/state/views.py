"""Memory behind memoryviews, kept as bytes; stretches of zeros are left out.

Views overlap: one that lies within another is kept with that.
"""

import ctypes
from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias

from firmware_runtime.blackbox.state.later import NoValue
from firmware_runtime.blackbox.state.layouts import UnkeepableState

Chunks: TypeAlias = dict[int, bytes]
"""Those with something in them, by their place in bytes."""

CHUNK: Final = 512
_ZEROS: Final = bytes(CHUNK)


class Views:
    """The memory behind some views, given with their paths. Raises UnkeepableState."""

    def __init__(self, views: Sequence[tuple[str, memoryview]]) -> None:
        places = [_place(path, view) for path, view in views]
        kept = _not_within_another(places)
        self._places = [places[number] for number in kept]
        self.paths = [views[number][0] for number in kept]
        self.views = [views[number][1] for number in kept]
        self._bytes = [view.cast("B") for view in self.views]

    def part(self, view: memoryview) -> tuple[memoryview, int, int, str]:
        """Where a view made later lies: within which, its first byte, the byte after it, format.

        Raises NoValue for one of other memory.
        """
        begin, end = _place("a memoryview", view)
        for place, known in zip(self._places, self.views, strict=True):
            if place[0] <= begin <= end <= place[1]:
                return known, begin - place[0], end - place[0], view.format
        raise NoValue("a memoryview of memory that was made during the run")

    def read(self) -> list[Chunks]:
        """What the memory holds."""
        return [_chunks(bytes(view)) for view in self._bytes]

    def fill(self, made: list[Chunks]) -> None:
        """Let the memory hold that. Raises ValueError where it does not fit."""
        for view, chunks in zip(self._bytes, made, strict=True):
            view[:] = _whole(chunks, len(view))

    def fields(self, read: list[Chunks]) -> Iterator[tuple[str, object]]:
        """Each item that is not zero."""
        for path, view, chunks in zip(self.paths, self.views, read, strict=True):
            items = memoryview(_whole(chunks, view.nbytes)).cast(view.format)  # type: ignore[call-overload]
            yield from ((f"{path}[{place}]", item) for place, item in enumerate(items) if item)


def _whole(chunks: Chunks, size: int) -> bytes:
    """So many bytes, of those chunks of it that are kept. Raises ValueError if they do not fit."""
    content = bytearray(size)
    for at, chunk in chunks.items():
        content[at : at + len(chunk)] = chunk
    if len(content) != size:
        raise ValueError(f"{len(content)} bytes for memory of {size}")
    return bytes(content)


def _chunks(content: bytes) -> Chunks:
    size = len(content)
    found = {}
    for at in range(0, size, CHUNK):
        chunk = content[at : at + CHUNK]
        if not _ZEROS.startswith(chunk):  # the last one may be shorter
            found[at] = chunk
    return found


def _place(path: str, view: memoryview) -> tuple[int, int]:
    """Where the memory begins and ends."""
    if not view.c_contiguous or view.readonly:
        raise UnkeepableState(
            path, "a memoryview with gaps, or not to be written to; expected another"
        )
    begin = ctypes.addressof(ctypes.c_char.from_buffer(view)) if view.nbytes else 0
    return begin, begin + view.nbytes


def _not_within_another(places: Sequence[tuple[int, int]]) -> list[int]:
    """Numbers of the largest, in order."""
    order = sorted(range(len(places)), key=lambda number: (places[number][0], -places[number][1]))
    ends = 0
    kept: list[int] = []
    for number in order:
        begin, end = places[number]
        if end > max(ends, begin):
            kept.append(number)
            ends = end
    return sorted(kept)
