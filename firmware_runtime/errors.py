"""The one root of every error this project raises.

Three families hang below it, named by who must act:

- `ModelError` (`firmware_runtime.devs.model_errors`): a bug in a model. Stop, outputs off, exit non-zero.
- `HalError` (`firmware_runtime.hal.wire_errors`): the world. Expected, counted, retried or turned into a
  `Fault` value on a port.
- `ConfigError` (`firmware_runtime.errors`): the user's input. Refuse to start, list all faults at
  once.
"""

from collections.abc import Sequence


def text_of(error: BaseException) -> str:
    """Return `str(error)` in one line, or a sentence where its `__str__` raises, whatever that is.

    A ConfigError keeps its lines, one for each fault. Errors are put into words before outputs are
    off: no text may keep them on.
    """
    try:
        text = str(error)
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


def _one_line(text: str) -> str:
    return " ".join(filter(None, map(str.strip, text.splitlines())))


_MOST_CAUSES = 10


class FirmwareRuntimeError(Exception):
    """Anything this project raises on purpose; its text is one sentence: where, what, expected."""


class ConfigError(FirmwareRuntimeError):
    """What the user gave cannot be used; `faults` lists every reason found, not just the first.

    The user must act: each fault names the key, what stands there and what was expected.
    """

    def __init__(self, where: str, faults: Sequence[str], sentence: str | None = None) -> None:
        self.where = where
        self.faults = tuple(faults)
        if sentence is not None:
            super().__init__(sentence)
            return
        listing = "\n".join(f"  - {fault}" for fault in self.faults)
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        super().__init__(f"{where}: {count}\n{listing}")

    @classmethod
    def of_one(cls, where: str, fault: str) -> "ConfigError":
        """The error of a thing that can have but one fault, as one sentence."""
        return cls(where, [fault], f"{where}: {fault}")


class SettingError(FirmwareRuntimeError, ValueError):
    """A chip cannot be set as asked; the board check lists its sentence among the faults."""
