"""The root of every error of this project, and the exit statuses of the command.

Three families hang below it, named by who must act:

- `ModelError` (`firmware_runtime.devs.model_errors`): a bug in a model. Stop, outputs off, exit
  non-zero.
- `HalError` (`firmware_runtime.hal.wire_errors`): the world. Expected, counted, retried or turned
  into a `Fault` value on a port.
- `ConfigError` (`firmware_runtime.errors`): the user's input. Refuse to start, list all faults at
  once.
"""

import errno
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import ClassVar, Final, NoReturn, Self, TypeVar


def text_of(error: BaseException) -> str:
    """Return `str(error)` in one line, or a sentence where its `__str__` raises, whatever that is.

    A ConfigError keeps its lines, one for each fault. Errors are put into words before outputs are
    off: no text may keep them on. Lone surrogates, as in the name of a file that is no UTF-8, are
    escaped.
    """
    try:
        text = legible(str(error))
        return text if isinstance(error, ConfigError) else _one_line(text)
    except BaseException as worse:  # noqa: BLE001 -- whatever it is, outputs come first
        return f"{type(error).__name__}, whose __str__ raised {type(worse).__name__}"


def raised_words(error: BaseException) -> str:
    """Return the classes of an error and of its causes, and its text."""
    kinds: list[str] = []
    each: BaseException | None = error
    while each is not None and len(kinds) < _MOST_CAUSES:
        kinds.append(type(each).__qualname__)
        each = each.__cause__
    return f"{' of '.join(kinds)}: {text_of(error)}"


def raised_at(error: BaseException) -> tuple[str, int] | None:
    """Return the file and line where an error was raised, or what it came of; None for nowhere."""
    traceback = _first(error).__traceback__
    while traceback is not None and traceback.tb_next is not None:
        traceback = traceback.tb_next
    if traceback is None:
        return None
    return traceback.tb_frame.f_code.co_filename, traceback.tb_lineno


def place_of_bug(error: BaseException | None) -> str:
    """Return ` (FILE, line NUMBER)` of what an error came of, unless that was said on purpose.

    What came of nothing else is no bug of a model, such as a full disk.
    """
    if error is None or error.__cause__ is None or isinstance(_first(error), FirmwareRuntimeError):
        return ""
    place = raised_at(error)
    return "" if place is None else f" ({place[0]}, line {place[1]})"


def _first(error: BaseException) -> BaseException:
    """What an error came of."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error


def legible(text: str) -> str:
    """Return a text that UTF-8 has: what came from outside may have lone surrogates."""
    return text.encode("utf-8", "backslashreplace").decode()


def _one_line(text: str) -> str:
    return " ".join(filter(None, map(str.strip, text.splitlines())))


_MOST_CAUSES = 10
_MOST_LISTED = 12


class FirmwareRuntimeError(Exception):
    """Anything this project raises on purpose; its text is one sentence, made of its attributes.

    `where` it is, `what` is wrong there, and what was `expected` instead; each may be empty.
    """

    where = ""
    what = ""
    expected = ""

    def __init__(self, what: object = "", *, where: object = "", expected: object = "") -> None:
        self.where, self.what, self.expected = str(where), str(what), str(expected)
        super().__init__(sentence(self.where, self.what, self.expected))


def sentence(where: str, what: str, expected: str) -> str:
    """Return the sentence of an error: `where: what; expected ...`, without what is empty."""
    if what.endswith("?"):
        fault = f"{what} Expected {expected}" if expected else what
    else:
        fault = "; ".join(filter(None, (what, f"expected {expected}" if expected else "")))
    return ": ".join(filter(None, (where, fault)))


class ConfigError(FirmwareRuntimeError):
    """What the user gave cannot be used; `faults` lists every reason found, not just the first.

    The user must act: each fault names the key, what stands there and what was expected.
    """

    def __init__(self, where: str, faults: Sequence[str], sentence: str | None = None) -> None:
        self.faults = tuple(faults)
        if sentence is None:
            listing = "\n".join(f"  - {fault}" for fault in self.faults)
            count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
            sentence = f"{where}: {count}\n{listing}"
        super().__init__(sentence)
        self.where, self.what = where, "; ".join(self.faults)

    @classmethod
    def of_one(cls, where: object, what: object, expected: object = "") -> Self:
        """Return the error of a thing that can have but one fault, as one sentence."""
        fault = sentence("", str(what), str(expected))
        error = cls(str(where), [fault], f"{where}: {fault}")
        error.what, error.expected = str(what), str(expected)
        return error


class UnknownName(FirmwareRuntimeError, KeyError):
    """There is nothing of that name; the sentence has the nearest one, and those there are."""

    @classmethod
    def of(cls, noun: str, name: object, known: Iterable[str]) -> Self:
        """Return the error of a name that is none of those known."""
        names = list(known)
        alike = nearest(str(name), names)
        meant = "" if alike is None else f" (did you mean {alike}?)"
        more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
        listed = ", ".join(names[:_MOST_LISTED])
        return cls(f"no {noun} {name!r}{meant}", expected=f"one of {listed}{more}" if names else "")

    def __str__(self) -> str:
        return sentence(self.where, self.what, self.expected)  # a KeyError would quote it


V = TypeVar("V")


class Named(dict[str, V]):
    """A dictionary by names; a name that it has not raises UnknownName, which is a KeyError."""

    __slots__ = ()
    noun: ClassVar = "entry"

    def __missing__(self, name: object) -> NoReturn:
        raise UnknownName.of(self.noun, name, self)


class SettingError(FirmwareRuntimeError, ValueError):
    """A chip cannot be set as asked; the board check lists its sentence among the faults."""


class Status(IntEnum):
    """Exit statuses of the command, the same for every verb."""

    OK = 0
    MODEL_ERROR = 1
    """A model failed, a device was never ready, or a policy stopped the run; outputs are off."""
    BAD_INPUT = 2
    """The command line, a board file or a statistics file is not usable; nothing was touched."""
    NO_DEVICE = 3
    """A bus or chip is missing, or the run that a request was for; nothing was actuated."""
    NOT_SAFE = 4
    """The run ended, but some outputs could not be switched off."""
    REFUSED = 5
    """Something speaks against arming, or a trial was not agreed to; nothing was actuated."""
    NOTHING_HAPPENED = 6
    """Timed out waiting for an event."""
    DOCTOR_WARNS = 7
    """The doctor's worst finding is a warning: a run works, but not as well as it could."""
    DOCTOR_FAILS = 8
    """The doctor's worst finding is a failure: a run fails or does not get what it asks for."""
    NOT_DEPLOYED = 9
    """A target could not be reached or did not take the program; the one it had is still there."""
    NOT_PRINTED = 10
    """Done, but not all of it was printed, traced, recorded or drawn, as where a disk is full."""
    CANNOT_TELL = 11
    """`gate`: this machine cannot tell whether HEAD is slower or not."""
    NOT_ALL_COMPARED = 12
    """`replay`, `continuity`: no difference, but not everything could be compared."""
    INTERRUPTED = 130
    TERMINATED = 143

    @classmethod
    def of_comparison(cls, identical: bool | None) -> "Status":  # noqa: FBT001 -- a verdict
        """The status of a comparison; None is one in which not everything could be compared."""
        if identical is None:
            return cls.NOT_ALL_COMPARED
        return cls.OK if identical else cls.MODEL_ERROR


OF_THE_MACHINE: Final = frozenset(
    {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ENOMEM, errno.EMFILE, errno.ENFILE}
)
"""Numbers of errors that describe the state of the machine, and not of the request."""
ROOM_EXPECTED: Final = "expected a disk with room that is writable"


class StatisticsFileError(FirmwareRuntimeError):
    """A statistics file is absent, not ours, of another version, damaged, or cannot be made."""


class NoRoomError(StatisticsFileError):
    """A file cannot be made as the machine is now: its disk is full, read-only or fails.

    That is no bad input, and may be over when the service tries again.
    """


class BeingWrittenError(StatisticsFileError):
    """A living writer keeps a file half written: it is stopped there, or never pauses."""


class TraceFileError(FirmwareRuntimeError):
    """A trace cannot be written to the requested place."""


class TraceNotWholeError(TraceFileError):
    """A trace lacks something, as where the disk is full; the run went on to its end."""


def in_words(error: Exception) -> str:
    """What msgspec says of a value, its place first: ``run.steps: expected `int`, got `str` ``."""
    fault, _, place = str(error).partition(" - at ")
    place = place.strip("`").removeprefix("$").removeprefix(".")
    fault = fault[:1].lower() + fault[1:]
    return f"{place}: {fault}" if place else fault


class ControlError(FirmwareRuntimeError):
    """A run cannot be spoken to."""


class DeploymentError(FirmwareRuntimeError):
    """The target cannot be reached, lacks something, or did not take the program.

    What ran there before is still there; the text says where it is not so.
    """


class InstallationRefused(FirmwareRuntimeError):
    """Something is not as it must be; nothing was touched."""


class StepFailed(FirmwareRuntimeError):
    """A file could not be written or a program of the system failed; what went before stands."""


def with_article(noun: str) -> str:
    """`a NOUN` or `an NOUN`, by its first letter."""
    return f"{'an' if noun[:1].lower() in tuple('aeiou') else 'a'} {noun}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`; did you mean X?`, or nothing if no known word is like it."""
    alike = nearest(word, known)
    return "" if alike is None else f"; did you mean {alike}?"


def expected_one_of(word: str, known: Iterable[str]) -> str:
    """`did you mean X? Expected one of X, Y`; without X where no known word is like it."""
    names = list(known)
    return suggested(word, names, f"expected one of {', '.join(names) or 'none'}")


def suggested(word: str, known: Iterable[str], expected: str) -> str:
    """What was expected, with the known word that was probably meant before it, if any is."""
    alike = nearest(word, known)
    if alike is None:
        return expected
    return f"did you mean {alike}? {expected[:1].upper()}{expected[1:]}"


def nearest(word: str, known: Iterable[str], share: float = 0.6) -> str | None:
    """Return the known word that is most like one that is not known, if any is like it.

    Alike are words that share so much of their letters.
    """
    from difflib import get_close_matches  # noqa: PLC0415 -- for a word that is not known only

    alike = get_close_matches(word, list(known), 1, share)
    return alike[0] if alike else None
