"""The entry point: reads the command line, calls one verb, turns errors into sentences.

Only the verb that is called is imported, so that a robot's start does not wait for the others.
"""

import argparse
import errno
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import cache, partial
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn

from firmware_runtime.cli.verbs import ADDED, OF_LINUX, VERBS, help_lines, verb_names
from firmware_runtime.errors import (
    ConfigError,
    ControlError,
    DeploymentError,
    FirmwareRuntimeError,
    NoRoomError,
    StatisticsFileError,
    Status,
    TraceFileError,
    TraceNotWholeError,
    expected_one_of,
)
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge, WrongDevice
from firmware_runtime.system.command_garbage import (
    no_collection_at_the_end,
    no_collection_of_the_start,
)
from firmware_runtime.system.packages import installed
from firmware_runtime.system.resources import ran_out_of
from firmware_runtime.system.terminal import (
    OutputError,
    not_printed,
    output_checked,
    print_line,
    readers_may_go,
)
from firmware_runtime.system.this_process import come_first
from firmware_runtime.system.this_system import demand_linux

_PROBE = "; `firmware-runtime probe` shows what answers on the buses"
_NAME_SHOWN = 80
_NO_NAME = r"[^/\s]{256,}"
"""What is longer than any file's name."""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "1")
"""For numpy, whose import starts a pool of threads else: the thread of the loop is the only one."""
_ARGUMENT = "argument "
"""What argparse begins with where it names an option."""
_NUMBERS = {"int": "a whole number", "float": "a number"}
"""What argparse calls the types that a verb takes as they are, and what they are."""
_CHOICE = r"invalid choice: '(.*)' \(choose from (.*)\)$"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status; without arguments, as a process of its own."""
    os.environ.setdefault(*ONE_THREAD)
    if sys.stdin is None:  # what called this has closed it
        sys.stdin = os.fdopen(os.open(os.devnull, os.O_RDONLY), closefd=False)
    if arguments is not None:
        return _main(arguments, nullcontext())
    if "_ARGCOMPLETE" in os.environ:  # a shell asks how a line may go on
        import_module("firmware_runtime.cli.completer").complete()
    words = sys.argv[1:]
    if words[:1] == ["safe-state"]:
        come_first()
    with no_collection_at_the_end():
        return _main(words, no_collection_of_the_start())


def _main(words: Sequence[str], starting: AbstractContextManager[None]) -> int:
    """Parse the words, within `starting`, and carry them out."""
    try:
        with starting:
            parsed = _parsed(words)
    except ConfigError as error:  # of a verb of another package
        return _refuse(error, Status.BAD_INPUT)
    except KeyboardInterrupt:  # while the verb is imported
        return Status.INTERRUPTED
    status: int = Status.OK  # of a verb that showed something, to a reader who has gone
    with output_checked():
        try:
            with readers_may_go():
                status = _carried_out(parsed)
        except OutputError as error:
            not_printed(error)
            status = status or Status.NOT_PRINTED
        except (MemoryError, OSError) as error:
            status = _refuse(ran_out_of(error), Status.MODEL_ERROR)
    return status


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    """The words as the verb has them; exits where there is none, or where they do not fit."""
    if not words:
        parser(["--help"]).refuse("no command; expected one that `firmware-runtime --help` shows")
    return parser(words).parse_args(words)


def _carried_out(parsed: argparse.Namespace) -> int:
    """Carry out the verb; what cannot be carried out is a sentence and a status."""
    try:
        if parsed.verb in OF_LINUX:
            demand_linux(parsed.verb)
        status = _executed(parsed) if parsed.verb in VERBS else _executed_by_another(parsed)
    except (ConfigError, StatisticsFileError, TraceFileError) as error:
        return _refuse(error, _status_of_input(error))
    except (HalError, ControlError) as error:
        return _refuse(error, Status.NO_DEVICE, _hint(error, parsed))
    except DeploymentError as error:
        return _refuse(error, Status.NOT_DEPLOYED)
    except FirmwareRuntimeError as error:
        return _refuse(error, Status.MODEL_ERROR)
    except KeyboardInterrupt:
        return Status.INTERRUPTED  # before or after the loop, which sees to its own signals
    return status


def _status_of_input(error: FirmwareRuntimeError) -> Status:
    """The status of what was given, where neither the disk is at fault nor all but it was done."""
    if isinstance(error, NoRoomError):
        return Status.MODEL_ERROR
    return Status.NOT_PRINTED if isinstance(error, TraceNotWholeError) else Status.BAD_INPUT


def _executed(parsed: argparse.Namespace) -> int:
    """Call the verb; a name that no file can have is bad input, whatever it was the name of."""
    try:
        status: int = parsed.execute(parsed)
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        raise ConfigError(str(error.filename), ["file name too long"]) from error
    return status


def _executed_by_another(parsed: argparse.Namespace) -> int:
    """Call a verb of another package. Raises ConfigError, also for a defect in it."""
    providers = [each for each in installed(ADDED) if each.name == parsed.verb]
    if not providers:  # added under another name than its entry point's
        return _executed(parsed)
    added = import_module("firmware_runtime.cli.added_verbs")
    status: int = added.carried_out(providers[0], partial(_executed, parsed))
    return status


class _ShowVersion(argparse.Action):
    """Looks the version up when it is to be shown."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it, and end."""
        packages = import_module("firmware_runtime.system.packages")
        print(f"{parser.prog} {packages.version_of('firmware-runtime')}")
        parser.exit()


@cache
def _columns() -> int:
    """How wide the terminal is; 80 where there is none."""
    try:
        stated = int(os.environ.get("COLUMNS", ""))
    except ValueError:
        stated = 0
    if stated > 0:
        return stated
    try:
        return os.get_terminal_size(sys.__stdout__.fileno()).columns or 80  # type: ignore[union-attr]
    except (AttributeError, ValueError, OSError):
        return 80


class _Formatter(argparse.HelpFormatter):
    """As argparse's, which loads `shutil` for the width each time an argument is added."""

    def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 -- as argparse has it
        super().__init__(*arguments, **{"width": _columns() - 2, **options})


class Parser(argparse.ArgumentParser):
    """Like argparse's, and so are those of its verbs."""

    def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 -- as argparse has it
        super().__init__(*arguments, **{"formatter_class": _Formatter, **options})

    def error(self, message: str) -> NoReturn:
        """Print what is wrong, with what was probably meant and what was expected; exit with 2.

        A value that is none is a sentence; a word too many or too few is shown with the usage.
        """
        found = re.search(_CHOICE, message)
        if found is not None:
            word, choices = found[1], re.findall(r"[^\s',]+", found[2])
            message = f"{message[: found.start()]}'{word}': {expected_one_of(word, choices)}"
        for kind, expected in _NUMBERS.items():
            message = re.sub(
                rf"invalid {kind} value: ('.*')$", rf"\1: expected {expected}", message
            )
        if message.startswith(_ARGUMENT):
            self.refuse(message.removeprefix(_ARGUMENT))
        super().error(message)

    def refuse(self, sentence: str) -> NoReturn:
        """Print one sentence on what is wrong; exit with 2."""
        self.exit(Status.BAD_INPUT, f"{self.prog}: {sentence}\n")


class _Top(Parser):
    """The command line before the verb: its help has the verbs in groups."""

    def format_help(self) -> str:
        """Return the usage, a line for each verb, and what is the same for all of them."""
        usage, about, rest = super().format_help().split("\n\n", 2)
        return "\n".join([usage, "", about, "", *help_lines(), rest])


def parser(words: Sequence[str]) -> Parser:
    """The command line with the verb that `words` begin with; without words, with every verb.

    Exits with a sentence where they begin with what is no verb.
    """
    top = _Top(
        prog="firmware-runtime",
        usage="firmware-runtime COMMAND ...",
        description="Run DEVS models as the firmware of a robot.",
        epilog="Exit status: 0 done, 1 a model failed or a device was never ready, 2 bad input, "
        "3 a bus or chip is missing, or there is no run, 4 some output could not be switched off, "
        "5 refused to arm or to move, 6 timed out waiting for an event, "
        "or a step of `service` failed, "
        "7 and 8 the doctor's worst finding is a warning or a failure, 9 not deployed, "
        "10 done but not printed or written, 11 cannot tell here, "
        "12 no difference in what could be compared, "
        "130 and 143 stopped by SIGINT and SIGTERM.",
    )
    top.add_argument(
        "-V",
        "--version",
        action=_ShowVersion,
        nargs=0,
        help="show program's version number and exit",
    )
    if words and words[0].startswith("-"):  # which asks for no verb
        return top
    if words and words[0] not in VERBS and words[0] not in (names := verb_names()):
        top.refuse(f"{words[0]}: no such command; {expected_one_of(words[0], names)}")
    verbs = top.add_subparsers(
        required=True, metavar="COMMAND", dest="verb", prog=top.prog, parser_class=Parser
    )
    for verb in _modules(words):
        verb.add_to(verbs)
    _add_others(words, verbs)
    return top


def _modules(words: Sequence[str]) -> Iterator[ModuleType]:
    """The modules of our verbs: of the one that `words` begin with, or of all; none for another."""
    names = [each for each in words[:1] if each in VERBS] if words else VERBS
    for module in dict.fromkeys(VERBS[name].module for name in names):
        yield import_module(f"firmware_runtime.cli.commands.{module}")


def _add_others(words: Sequence[str], verbs: object) -> None:
    """Add the verb of another package that `words` begin with, or all that are sound."""
    if words and words[0] in VERBS:
        return
    others = [each for each in installed(ADDED) if each.name not in VERBS]
    if others:
        # Reads boards, which takes long; a start of one of our own verbs does without.
        added = import_module("firmware_runtime.cli.added_verbs")
        asked_for = [each for each in others if each.name in words[:1]]
        add = added.add_verb if asked_for else added.add_sound_verb
        for each in asked_for or others:
            add(each, verbs)


def _hint(error: Exception, parsed: argparse.Namespace) -> str:
    """What to do about a chip that is not there; on doubles nothing could be asked."""
    is_chip = isinstance(error, NoAcknowledge | WrongDevice)
    return _PROBE if is_chip and not getattr(parsed, "doubles", None) else ""


def _refuse(error: FirmwareRuntimeError, status: Status, hint: str = "") -> int:
    said = re.sub(_NO_NAME, lambda found: f"{found[0][:_NAME_SHOWN]}...", str(error))
    print_line(f"firmware-runtime: {said}{hint}", sys.stderr)
    return status
