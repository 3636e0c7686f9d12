"""`firmware-runtime debug RUN --at T`: go to an instant of a recorded run, and look."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

from firmware_runtime.cli.arguments import SubParsers, add_recorded, add_verb, second
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.debugger.commands import Commands
from firmware_runtime.recording.debugger.debugger import Debugger, Ended
from firmware_runtime.recording.debugger.pdb_inside import PdbInside
from firmware_runtime.recording.debugger.travel import Travel
from firmware_runtime.system.terminal import print_line

_PROMPT = "(debug) "
_ABOUT = """
Replays the recording from the keyframe before T and stops where T has happened. Then it takes
commands, from a terminal or from standard input, one a line; `help` lists them. With --until or
--print it carries these out and ends. Nothing is actuated. Exit status 6: what --until waits for
does not happen before the recording ends.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Go to an instant of a recorded run; look at its models, step, also backwards."
    verb = add_verb(verbs, "debug", summary, execute)
    verb.epilog = _ABOUT
    add_recorded(verb)
    verb.add_argument(
        "--at", type=second, metavar="T", help="second of the run; default: where it begins"
    )
    verb.add_argument(
        "--until", metavar="PREDICATE", help="go on to where it begins to hold: 'sensor.fault'"
    )
    verb.add_argument(
        "--print",
        action="append",
        default=[],
        metavar="PATH",
        dest="printed",
        help="print a model, a port or an attribute; may be repeated",
    )
    verb.add_argument("--json", action="store_true", help="print each answer as a line of JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Go there, and carry out commands."""
    recording = read_recording(find_recording(arguments.run))
    board = board_of(recording.header)
    travel = Travel(recording, board, arguments.at)
    stated = _stated(arguments)
    is_terminal = stated is None and sys.stdin.isatty() and not arguments.json
    for fault in recording.faults():
        print_line(f"debug: {recording.path} is not whole: {fault}", sys.stderr)
    session = _Session(travel, stated, is_json=arguments.json, is_terminal=is_terminal)
    if arguments.at is None:
        session.debugger.stay()
    else:
        session.debugger.go_to_instant(arguments.at)
    session.debugger.run()
    return session.status


def _stated(arguments: argparse.Namespace) -> list[str] | None:
    """The commands of the command line; None if they are to be read."""
    until = [] if arguments.until is None else [f"until {arguments.until}"]
    printed = [f"print {path}" for path in arguments.printed]
    return [*until, *printed] or None


class _Session:
    """Reads commands at each stop until one goes somewhere."""

    def __init__(
        self, travel: Travel, stated: Sequence[str] | None, *, is_json: bool, is_terminal: bool
    ) -> None:
        pipe = None if is_terminal else sys.stdin
        attach = PdbInside(pipe, None if pipe is None else sys.stdout)
        self.debugger = Debugger(travel, self._stopped, attach)
        self.status: int = Status.OK
        self._commands = Commands(self.debugger, self._say)
        self._is_json = is_json
        self._is_terminal = is_terminal
        self._is_stated = stated is not None
        self._lines = _typed(self._commands) if is_terminal else _read(stated)
        self._waits = False
        self._last = ""

    def _stopped(self, reason: str) -> None:
        if self._is_stated and self._waits and reason == self.debugger.travel.ends_with:
            self.status = Status.NOTHING_HAPPENED
        self._commands.stopped(reason)
        for line in self._lines:
            if self._carried_out(line):
                return
        raise Ended

    def _carried_out(self, line: str) -> bool:
        """Whether a line goes somewhere."""
        words = line.strip() or (self._last if self._is_terminal else "")
        if not words or words.startswith("#"):
            return False
        self._last = words
        self._waits = words.partition(" ")[0] in ("until", "u")
        try:
            return self._commands.do(words)
        except ConfigError as error:
            if self._is_stated:
                raise
            print_line(f"debug: {error}", sys.stderr)
            if not self._is_terminal:
                self.status = Status.BAD_INPUT
            return False

    def _say(self, lines: list[str], found: dict[str, object]) -> None:
        print(json.dumps(found, allow_nan=False) if self._is_json else "\n".join(lines))
        sys.stdout.flush()


def _read(stated: Sequence[str] | None) -> Iterator[str]:
    """Lines of the command line, or of standard input: one at a time, for pdb reads there too."""
    if stated is not None:
        yield from stated
        return
    while line := sys.stdin.readline():
        yield line


def _typed(commands: Commands) -> Iterator[str]:
    """Lines that are typed, with history and completion where readline is there."""
    _complete(commands.completions)
    while True:
        try:
            yield input(_PROMPT)
        except EOFError:
            return


def _complete(completions: Callable[[str], list[str]]) -> None:
    with suppress(ImportError):
        import readline  # noqa: PLC0415 -- not everywhere

        def complete(_word: str, place: int) -> str | None:
            found = completions(readline.get_line_buffer())
            return found[place] if place < len(found) else None

        readline.set_completer(complete)
        readline.set_completer_delims(" ")
        readline.parse_and_bind("tab: complete")
