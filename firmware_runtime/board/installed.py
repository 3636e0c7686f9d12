"""The kinds of board that are installed, by their entry points, and what their packages do wrong.

A package of a user's own may have any defect. Whatever it raises becomes one sentence with the
package's name, and where in it that was.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from firmware_runtime.board.definition import BoardDefinition, definition_of
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, text_of
from firmware_runtime.system.packages import EntryPoint, installed, rivals
from firmware_runtime.system.signals import Signalled

FILE = "board.toml"
GROUP = "firmware_runtime.boards"


def names() -> list[str]:
    """The kinds of board that are installed, in alphabetical order."""
    return sorted(entry_point.name for entry_point in installed(GROUP))


def shipped_file(kind: str) -> Path:
    """The board.toml of an installed kind. Raises ConfigError if its package is not to be found."""
    entry_point = entry_point_of(kind)
    if not entry_point.is_sound:
        raise broken(entry_point, f"entry point {entry_point.value!r}; expected MODULE:OBJECT")
    with blamed_on(entry_point, "import"):
        found = find_spec(entry_point.module)
    if found is None or found.origin is None:
        raise broken(entry_point, f"no module {entry_point.module}; expected it in the package")
    return Path(found.origin).with_name(FILE)


def definition(kind: str) -> BoardDefinition[Any]:
    """Return the definition of a kind. Raises ConfigError if it breaks the contract."""
    entry_point = entry_point_of(kind)
    if both := " and ".join(rivals(GROUP, kind)):
        raise broken(entry_point, f"{both} both provide it; expected one of them uninstalled")
    with blamed_on(entry_point, "definition"):
        return definition_of(entry_point.load())


def entry_point_of(kind: str) -> EntryPoint:
    """The entry point of an installed kind."""
    return next(entry_point for entry_point in installed(GROUP) if entry_point.name == kind)


@contextmanager
def blamed_on(entry_point: EntryPoint, what: str) -> Iterator[None]:
    """Raise ConfigError for whatever a package's code raises that is no sentence of ours yet."""
    try:
        yield
    except FirmwareRuntimeError as error:
        if not isinstance(error, ValueError):  # a SettingError says what, but not whose
            raise
        raise broken(entry_point, f"{what}: {error}") from error
    except Signalled:
        raise
    except (Exception, SystemExit) as error:
        sentence = f"{what}: {type(error).__name__}: {text_of(error)}"
        raise broken(entry_point, f"{sentence}{_place(entry_point, error)}") from error


def broken(entry_point: EntryPoint, fault: str) -> ConfigError:
    """What is wrong with the package that provides a board or a rig."""
    kind = entry_point.group.rpartition(".")[2].removesuffix("s")
    return ConfigError.of_one(
        f"{kind} {entry_point.name} of the package {entry_point.package}", fault
    )


def _place(entry_point: EntryPoint, error: BaseException) -> str:
    """Where it was raised, as near as can be to what the package itself did."""
    if isinstance(error, SyntaxError):
        return ""  # it names the place itself
    import traceback  # noqa: PLC0415 -- of a package with a defect only

    frames = traceback.extract_tb(error.__traceback__)
    seen = [frame for frame in frames if not frame.filename.startswith("<frozen")]
    package = entry_point.value.partition(".")[0]
    own = [frame for frame in seen if package in Path(frame.filename).parts]
    return "".join(f" ({frame.filename}, line {frame.lineno})" for frame in (own or seen)[-1:])
