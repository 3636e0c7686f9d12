"""The shortest piece of a recording that shows a difference, as a recording of its own.

Where the present code replays the run to the bit, a piece can begin anywhere: the state is captured
there. Where it does not, only the keyframes of the recording are true, and a piece begins at one.
Each piece is tried before it is taken.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any, Final, TypeAlias

from msgspec.structs import replace

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    LARGEST_CHUNK,
    SECTION,
    Chunk,
    file_of,
    parts_of,
)
from firmware_runtime.recording.blackbox.reader import BEGINNINGS, Recording, kind_of
from firmware_runtime.recording.blackbox.section import Kind, Section, decode, encode
from firmware_runtime.recording.blackbox.state.keyframes import UnkeepableState
from firmware_runtime.recording.board_of_recording import changed_board
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.replay_assertion import difference_of, in_words
from firmware_runtime.recording.replay.stretch import Stretch, segments_of
from firmware_runtime.recording.replay.verdict import Verdict, replay
from firmware_runtime.recording.what_if.checkout import ask
from firmware_runtime.recording.what_if.what_if import Question, answer

Shows: TypeAlias = Callable[[Path], Mapping[str, object] | None]
_IN_TIME: Final = (Kind.STEP, Kind.KEYFRAME)


@dataclass(frozen=True, slots=True)
class Piece:
    """The file, what it shows, and which part of the run it is, ns."""

    content: bytes
    difference: Mapping[str, object] | None
    begin: int
    until: int
    steps: int


class Cutter:
    """Cuts pieces; `shows` returns the difference that a file shows, None for none."""

    def __init__(self, recording: Recording, board: Board, shows: Shows) -> None:
        self._recording, self._board, self._shows = recording, board, shows
        self._header = recording.chunks[0].contents[0]

    def around(self, at: int, *, is_true: bool) -> Piece:
        """The shortest that shows a difference that is at that instant of the run.

        `is_true` says that the present code does as the run did.
        """
        sections = self._sections(at)
        end = _last_at(sections, at) + 1
        begins = self._anywhere(sections, end) if is_true else _keyframes(sections, end)
        for begin, first in begins:
            content = self._file([*first, *sections[begin:end]])
            if (found := self._shown_by(content)) is not None:
                return _piece(content, found, decode(first[0]), sections[begin:end])
        fault = "no piece of it shows the difference by itself; expected one that a keyframe keeps"
        raise ConfigError.of_one("--as-test", fault)

    def stretch(self, stretch: Stretch) -> Piece:
        """Cut that stretch, of a run that the present code replays to the bit."""
        sections = self._sections(stretch.begin)
        end = _last_at(sections, stretch.until) + 1
        begin = _last_at(sections, stretch.begin - 1) + 1 if stretch.begin else 0
        if not any(kind_of(each) == Kind.STEP for each in sections[begin:end]):
            fault = "no step of the run is in this stretch; expected a longer one"
            raise ConfigError.of_one("--as-test", fault)
        first = self._state_at(sections, [begin]).get(begin) if begin else [sections[0]]
        if first is None:
            fault = "the robot's state cannot be kept where the stretch begins"
            raise ConfigError.of_one("--as-test", fault, expected="one from the run's start")
        rest = sections[max(begin, 1) : end]
        return _piece(self._file([*first, *rest]), None, decode(first[0]), rest)

    # ---------------------------------------------------------------------------------------------

    def _sections(self, at: int) -> list[bytes]:
        """Those of the segment that has the instant, from the beginning of it."""
        return segments_of(self._recording, Stretch(at))[0].contents

    def _anywhere(self, sections: Sequence[bytes], end: int) -> Iterator[tuple[int, list[bytes]]]:
        """Beginnings 1, 2, 4, ... sections before the end, then the first."""
        places, back = [], 1
        while end - back > 1:
            places.append(end - back)
            back *= 2
        states = self._state_at(sections, places)
        yield from ((place, states[place]) for place in places if place in states)
        yield 1, [sections[0]]

    def _state_at(self, sections: Sequence[bytes], places: Sequence[int]) -> dict[int, list[bytes]]:
        """Keyframes for those places where the state can be kept, made by running there."""
        found: dict[int, list[bytes]] = {}
        if not places:
            return found
        player = Player(self._recording.header, self._board, decode(sections[0]))
        for place in range(1, max(places) + 1):
            if place in places and player.table is not None:
                with suppress(UnkeepableState):
                    found[place] = _sections_of(player, player.table.capture())
            player.take(decode(sections[place]))
        return found

    def _shown_by(self, content: bytes) -> Mapping[str, object] | None:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "piece.recording"
            path.write_bytes(content)
            return self._shows(path)

    def _file(self, sections: Sequence[bytes]) -> bytes:
        """A recording of these sections, in as many chunks as they take."""
        room = LARGEST_CHUNK - CHUNK.size - 2 * SECTION.size - len(self._header)
        chunks = enumerate(parts_of(sections, room), start=1)
        return file_of([Chunk(number, [self._header, *each]) for number, each in chunks])


def _piece(
    content: bytes, found: Mapping[str, object] | None, first: Section, rest: Sequence[bytes]
) -> Piece:
    steps = [decode(each).at for each in rest if kind_of(each) == Kind.STEP]
    begin = first.at if first.kind is Kind.KEYFRAME else 0
    return Piece(content, found, begin, steps[-1] if steps else begin, len(steps))


def _sections_of(player: Player, state: bytes) -> list[bytes]:
    """The keyframe of where a player is, and what its recording has noted up to there."""
    kinds = ((Kind.KEYFRAME, state), (Kind.CLASSES, player.values.state()))
    return [
        encode((kind.value, player.at, [], [], [], [], [], [], [], extra)) for kind, extra in kinds
    ]


def _keyframes(sections: Sequence[bytes], end: int) -> Iterator[tuple[int, list[bytes]]]:
    """Beginnings that were recorded, the last first."""
    for place in range(end - 2, -1, -1):
        if kind_of(sections[place]) in BEGINNINGS:
            yield place + 1, [sections[place]]


def _last_at(sections: Sequence[bytes], at: int) -> int:
    """The place of the last section in time that is not after an instant."""
    last = 0
    for place, content in enumerate(sections):
        if kind_of(content) in _IN_TIME:
            if decode(content).at > at:
                break
            last = place
    return last


_WIDTH = 88
_TEST = '''\
"""{about}

{written}
"""

from pathlib import Path

from firmware_runtime.recording.replay.replay_assertion import assert_replays

RECORDING = Path(__file__).with_suffix(".recording")


def {name}() -> None:
    assert_replays(RECORDING{settings})
'''


def piece_of(
    recording: Recording, question: Question, checkout: Path | None
) -> tuple[Piece, Verdict]:
    """The piece of a run, and how the run was replayed.

    It shows where the run is not its replay; or else what the question's settings, or the code of a
    checkout, change; or else it is the question's stretch. Raises ConfigError if nothing changes.
    """
    board = changed_board(recording.header, ())
    stretch = Stretch(question.begin, question.until)
    verdict = replay(recording, board, stretch)
    if verdict.first is not None:
        cutter = Cutter(recording, board, _shown_here)
        return cutter.around(verdict.first.at, is_true=False), verdict
    if checkout is None and not question.assignments:
        return Cutter(recording, board, _shown_here).stretch(stretch), verdict
    first = _difference(question, checkout)
    if first is None:
        fault = "no output would have been another; expected a difference, or nothing that changes"
        raise ConfigError.of_one("--as-test", fault)

    def asked(path: Path) -> Mapping[str, Any] | None:
        whole = replace(question, recording=str(path.absolute()), begin=0, until=NEVER)
        return _difference(whole, checkout)

    return Cutter(recording, board, asked).around(first["t_ns"], is_true=True), verdict


def span_of_piece(piece: Piece) -> str:
    """From and to which second of its run it goes."""
    return f"{piece.begin / SECOND:.3f} to {piece.until / SECOND:.3f} s"


def test_of_piece(
    piece: Piece, recording: Recording, faults: Sequence[str], name: str, assignments: Sequence[str]
) -> str:
    """The source of a test of a piece, which looks for its recording beside itself."""
    about = f"{recording.header.run}, {span_of_piece(piece)}: it does as it did."
    if piece.difference is not None:
        shown = in_words(piece.difference)
        about = f"{recording.header.run}, {span_of_piece(piece)}: {shown}."
    if faults:
        about += f" The run's recording is not whole: {'; '.join(faults)}."
    settings = f", settings={list(assignments)!r}" if assignments else ""
    written = f"Written by `firmware-runtime replay {recording.path.name} --as-test`."
    texts = {"about": _in_docstring(about), "written": _in_docstring(written)}
    name = name if name.startswith("test_") else f"test_{name}"
    return _TEST.format(**texts, name=name, settings=settings)


def _difference(question: Question, checkout: Path | None) -> Mapping[str, Any] | None:
    """The first difference that the settings, or the code of a checkout, make."""
    found = answer(question) if checkout is None else ask(question, checkout)
    return found.first_difference


def _shown_here(path: Path) -> Mapping[str, Any] | None:
    return difference_of(path)[0]


def _in_docstring(text: str) -> str:
    """A text as Python reads it in a docstring, whatever is in it, in lines not too long."""
    quoted = repr(text)[1:-1].replace('"', '\\"')
    return "\n".join(wrap(quoted, _WIDTH, break_long_words=False, break_on_hyphens=False))
