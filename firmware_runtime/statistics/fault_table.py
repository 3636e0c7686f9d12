"""The faults that models reported, in fixed rows of the statistics file.

Every model with a port for faults has `KINDS` rows, one for each kind of fault in the order in
which they came, and a last one that takes all further kinds together. A row is free while its count
is zero. Texts are UTF-8, cut to fit and padded with zeros; kinds that are alike as far as they fit
are one.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.statistics.histogram import Cells

FAULT = ("count", "first_ns", "last_ns")
KINDS = 8
"""How many kinds of fault of one model are counted separately."""
ROWS = KINDS + 1
OTHER_KINDS = "other kinds"
"""What the last row counts: faults of every kind that found no row of its own."""
KIND_CELLS = 4
SENTENCE_CELLS = 32
ROW_CELLS = len(FAULT) + KIND_CELLS + SENTENCE_CELLS
MODEL_CELLS = ROWS * ROW_CELLS
NO_INSTANT = -1
"""Of a fault, where its instant is not known, or means nothing: in the sum of several runs."""

_COUNT, _FIRST, _LAST = range(len(FAULT))
_KIND = slice(len(FAULT), len(FAULT) + KIND_CELLS)
_SENTENCE = slice(_KIND.stop, ROW_CELLS)


class FaultCount(Struct):
    """Count of one kind of fault of a model, its first and last instants, ns, and last sentence."""

    kind: str
    count: int = 0
    first_at: int = NO_INSTANT
    last_at: int = NO_INSTANT
    sentence: str = ""


def row(cells: Cells, model: int, index: int) -> Cells:
    """One row of a model, of a fault block."""
    first = model * MODEL_CELLS + index * ROW_CELLS
    return cells[first : first + ROW_CELLS]


def kept_kind(kind: str) -> str:
    """As much of a kind as the table keeps."""
    return _decoded(_encoded(kind, 8 * KIND_CELLS))


def write(cells: Cells, counted: FaultCount) -> None:
    """Put a count into a row."""
    cells[_COUNT], cells[_FIRST], cells[_LAST] = counted.count, counted.first_at, counted.last_at
    _put(cells[_KIND], counted.kind)
    _put(cells[_SENTENCE], counted.sentence)


def write_again(cells: Cells, counted: FaultCount, *, in_new_words: bool) -> None:
    """Put a count into its row, where only the number, the instant and the words may be new."""
    cells[_COUNT], cells[_LAST] = counted.count, counted.last_at
    if in_new_words:
        _put(cells[_SENTENCE], counted.sentence)


def read(cells: Cells, model: int) -> list[FaultCount]:
    """All that was counted of a model, the kind that came first, first."""
    return list(_counted(cells, model))


def fill(cells: Cells, model: int, counted: Sequence[FaultCount]) -> None:
    """Let a model's rows hold these and nothing else; what finds no row goes into the last."""
    for index in range(ROWS):
        row(cells, model, index)[_COUNT] = 0
    others = FaultCount(OTHER_KINDS)
    named = [each for each in counted if each.kind != OTHER_KINDS]
    for index, each in enumerate(named[:KINDS]):
        write(row(cells, model, index), each)
    for each in (*named[KINDS:], *(each for each in counted if each.kind == OTHER_KINDS)):
        others = together(others, each)
    if others.count > 0:
        write(row(cells, model, KINDS), others)


def since(earlier: Sequence[FaultCount], later: Sequence[FaultCount]) -> list[FaultCount]:
    """Return what was counted of a model from an earlier reading to a later one of the same run.

    When a kind was first reported since then is known only if it was not reported before.
    """
    before = {each.kind: each.count for each in earlier}
    grown = [each for each in later if each.count > before.get(each.kind, 0)]
    return [
        replace(each, count=each.count - before[each.kind], first_at=NO_INSTANT)
        if each.kind in before
        else each
        for each in grown
    ]


def of_several_runs(runs: Iterable[Sequence[FaultCount]]) -> list[FaultCount]:
    """Return what was counted of a model in several runs.

    Instants of different runs mean nothing.
    """
    kinds: dict[str, FaultCount] = {}
    for each in chain.from_iterable(runs):
        counted = kinds.setdefault(each.kind, FaultCount(each.kind))
        counted.count += each.count
        counted.sentence = each.sentence
    return list(kinds.values())


def together(first: FaultCount, second: FaultCount) -> FaultCount:
    """Two counts as one of the first one's kind; the words are those of whichever was last."""
    last = max((first, second), key=lambda each: (each.count > 0, each.last_at))
    instants = [each.first_at for each in (first, second) if each.count > 0]
    first_at = min(instants, default=NO_INSTANT)
    return FaultCount(first.kind, first.count + second.count, first_at, last.last_at, last.sentence)


def _counted(cells: Cells, model: int) -> Iterator[FaultCount]:
    for index in range(ROWS):
        if cells[model * MODEL_CELLS + index * ROW_CELLS + _COUNT] > 0:  # few are
            found = row(cells, model, index)
            yield FaultCount(
                OTHER_KINDS if index == KINDS else _text(found[_KIND]),
                found[_COUNT],
                found[_FIRST],
                found[_LAST],
                _text(found[_SENTENCE]),
            )


def _put(cells: Cells, text: str) -> None:
    room = cells.cast("B")
    room[:] = _encoded(text, len(room)).ljust(len(room), b"\0")


def _encoded(text: str, size: int) -> bytes:
    """At most `size` bytes; of a longer text no more is read, for this is done in a step."""
    printable = "".join(each if each.isprintable() else " " for each in text[:size])
    return printable.encode(errors="replace")[:size]


def _text(cells: Cells) -> str:
    return _decoded(bytes(cells))


def _decoded(text: bytes) -> str:
    return text.rstrip(b"\0").decode(errors="ignore")
