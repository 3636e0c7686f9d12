"""Output files: one output of the top model a line, `HH:MM:SS:mmm port value`.

Port names are in lower case, as E-CD++ writes them. Lines of one instant are in order of port name;
values of one port in the order in which they were sent.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.ecdpp.text import format_time
from firmware_runtime.system.atomic_file import keep_output


class OutputLine(NamedTuple):
    """What left by an output port of the top model at an instant (ns)."""

    at: int
    port: str
    value: object

    def __str__(self) -> str:
        return f"{format_time(self.at)} {self.port} {_text(self.value)}"


class OutputRecord:
    """Listens to the output ports of an engine's root from now on."""

    def __init__(self, engine: Engine) -> None:
        self._lines: list[OutputLine] = []
        for port in engine.root.out_ports.values():
            self._listen(engine, port)

    @property
    def lines(self) -> list[OutputLine]:
        """The outputs so far, in the order of the file."""
        return sorted(self._lines, key=lambda line: (line.at, line.port))

    def _listen(self, engine: Engine, port: OutPort[Any]) -> None:
        name = port.name.lower()
        engine.listen(port, lambda at, value: self._lines.append(OutputLine(at, name, value)))


def write_outputs(path: Path, lines: Iterable[OutputLine]) -> None:
    """Write the lines to a file. Raises ConfigError if it cannot be written."""
    keep_output(path, "".join(f"{line}\n" for line in lines).encode(), "--outputs")


def _text(value: object) -> str:
    """A whole number without its decimals, truth as 1 and 0, anything else as it is."""
    if isinstance(value, float) and not value.is_integer():
        return str(value)
    return str(int(value)) if isinstance(value, int | float) else str(value)
