"""Experimental frame: a model with its inputs played from events and its outputs recorded.

The frame is a model too, so the same run can take virtual, scaled or real time: give `Experiment`
to whatever runs models, and an `OutputRecord` to listen. `run_events` is that in virtual time.

Output files have one output of the top model a line, `HH:MM:SS:mmm port value`. Port names are in
lower case, as E-CD++ writes them. Lines of one instant are in order of port name; values of one
port in the order in which they were sent.
"""

from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Final, NamedTuple

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND
from firmware_runtime.ecdpp.event_file import Event
from firmware_runtime.ecdpp.file_text import format_time
from firmware_runtime.system.atomic_file import keep_output


class OutputLine(NamedTuple):
    """Value that left by an output port of the top model at an instant (ns)."""

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

    def _listen(self, engine: Engine, port: OutPort[object]) -> None:
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


AFTERMATH: Final = 10 * SECOND
"""How long a run without a stated end goes on after its last event."""


class EventPlayer(Atomic):
    """Sends every event at its instant; has one output port for each input port to feed.

    waiting (until the next event) --port!value--> waiting | passive
    """

    def __init__(
        self, name: str, inputs: Iterable[InPort[object]], events: Sequence[Event]
    ) -> None:
        super().__init__(name)
        for port in inputs:
            self.out_port(port.name, port.type)
        self._instants = [(at, list(each)) for at, each in groupby(events, lambda each: each.at)]
        self._next = 0

    def initialize(self) -> None:
        """Wait for the first event."""
        self._next = 0
        self._wait(0)

    def output(self) -> None:
        """Send all events of this instant."""
        _, events = self._instants[self._next]
        for event in events:
            self.out_ports[event.port].send(event.value)

    def internal(self) -> None:
        """Wait for the next event."""
        now, _ = self._instants[self._next]
        self._next += 1
        self._wait(now)

    def _wait(self, now: int) -> None:
        if self._next < len(self._instants):
            self.hold_in("waiting", self._instants[self._next][0] - now)
        else:
            self.passivate()


class Experiment(Coupled):
    """events -> model -> output ports of the same names and types."""

    def __init__(self, model: Component, events: Sequence[Event]) -> None:
        super().__init__("experiment")
        player = self.add(EventPlayer("events", model.in_ports.values(), events))
        self.add(model)
        for name, port in model.in_ports.items():
            self.couple(player.out_ports[name], port)
        for name, output in model.out_ports.items():
            self.couple(output, self.out_port(name, output.type))


def end_of(events: Sequence[Event]) -> int:
    """Return when a run without a stated end is over: `AFTERMATH` after the last event."""
    return (events[-1].at if events else 0) + AFTERMATH


def run_events(
    model: Component, events: Sequence[Event], until: int | None = None, *, checked: bool = False
) -> list[OutputLine]:
    """Run a model on events in virtual time, up to and including `until`; return its output lines.

    Without `until` the run is over 10 s after the last event: a model may never end. With
    `checked` the simulator watches the laws of the formalism, at the price of speed.
    """
    simulator = Simulator(Experiment(model, events), checked=checked)
    record = OutputRecord(simulator)
    try:
        simulator.run(end_of(events) if until is None else until)
    finally:
        failures = simulator.exit()
    for failure in failures:
        raise failure
    return record.lines
