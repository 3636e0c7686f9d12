"""What `--link` says: over what the two ends of a cut speak with each other.

    unix:PATH    two runs on one machine

PATH is of the end that has the hardware, at both ends alike: it listens there, and the other one
speaks to it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.channel import Channel, PathChannel

OPTION: Final = "--link"
_LONGEST_PATH: Final = 90
"""Bytes of a path, so that the name of a role fits behind it: a socket's has 107."""


@dataclass(frozen=True, slots=True)
class End:
    """Which end is to be opened: the role, and whether it has the hardware."""

    role: str
    has_hardware: bool
    timeout: int
    """Ns after which a frame is too old."""


OpenChannel: TypeAlias = Callable[[End], Channel]
"""Opens the way to the other end; raises ConfigError where that cannot be."""


def link_address(text: str) -> OpenChannel:
    """Read what `--link` says. Raises ConfigError."""
    scheme, _, rest = text.partition(":")
    if scheme not in _SCHEMES or (rest == "" and ":" in text):
        expected = "expected unix:PATH"
        raise ConfigError.of_one(OPTION, f"{text!r}: {expected}")
    return _SCHEMES[scheme](rest)


def _unix(rest: str) -> OpenChannel:
    path = Path(rest).absolute()
    if not rest or len(str(path).encode()) > _LONGEST_PATH:
        fault = f"unix:{rest}: expected a path of {_LONGEST_PATH} bytes at most"
        raise ConfigError.of_one(OPTION, fault)

    def open_path(end: End) -> Channel:
        beside = path.with_name(f"{path.name}.other")
        return PathChannel(path, beside) if end.has_hardware else PathChannel(beside, path)

    return open_path


_SCHEMES: Final[dict[str, Callable[[str], OpenChannel]]] = {"unix": _unix}
