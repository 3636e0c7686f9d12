"""A script of faults as a pytest file: who found it, the faults, and what is asserted."""

from collections.abc import Mapping, Sequence
from typing import Final

from msgspec import Struct

from firmware_runtime.hal.strike import Strike, interval_of

_TEST: Final = '''"""{title}

{about}
"""

{imported}

{faults}


def {name}() -> None:
{body}
'''


class FaultTest(Struct, frozen=True, kw_only=True):
    """A test of a script of faults: the docstring, what it imports, and the lines of its body."""

    name: str
    title: str
    about: str
    imported: str
    faults: Sequence[Strike]
    body: Sequence[str]

    def text(self) -> str:
        """Return the source of the file."""
        return _TEST.format(
            title=self.title,
            about=self.about,
            imported=self.imported,
            faults=self._faults(),
            name=self.name if self.name.startswith("test_") else f"test_{self.name}",
            body="\n".join(f"    {each}" if each else "" for each in self.body),
        )

    def _faults(self) -> str:
        if not self.faults:
            return "FAULTS: list[Strike] = []"
        lines = (f"    {each}," for each in sources_of(self.faults))
        return "\n".join(["FAULTS = [", *lines, "]"])


def source_of(strike: Strike) -> str:
    """Return a fault as Python has it."""
    words = [quoted(strike.kind)]
    if strike.device:
        words.append(quoted(strike.device))
    words.append(f"at_s={strike.at_s!r}")
    if strike.for_s is not None:
        words.append(f"for_s={strike.for_s!r}")
    if strike.amount is not None:
        words.append(f"amount={strike.amount!r}")
    return f"Strike({', '.join(words)})"


def sources_of(strikes: Sequence[Strike]) -> list[str]:
    """Return faults as a list in Python has them; one that comes again and again is one."""
    if (every_s := interval_of(strikes)) is not None:
        return [f"*{source_of(strikes[0])}.again({len(strikes)}, every_s={every_s!r})"]
    return [source_of(each) for each in strikes]


def set_source(settings: Mapping[str, object]) -> str:
    """Return settings as one more argument; nothing where there are none."""
    return f", set={dict(settings)!r}" if settings else ""


def quoted(text: str) -> str:
    """Return a text in quotes, as the formatter has it."""
    return '"' + repr(text)[1:-1].replace('"', '\\"') + '"'
