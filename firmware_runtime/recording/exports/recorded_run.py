"""A recorded run in the hands of a program: what passed its ports, as values and as a table."""

from collections.abc import Mapping
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import UnknownName
from firmware_runtime.recording.blackbox.listing import span_of
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.typed_values import (
    Port,
    Sent,
    entrance,
    model_of,
    passed,
    ports_of,
)
from firmware_runtime.statistics.port_values import PortValues, table_of


class RecordedRun:
    """A recording that was read, as far as it had come then.

    Values are of their ports' types, as the models sent them. Ports of a world on doubles, which
    this reader does not have, are of what they were recorded as: numbers, texts, tuples of these.
    """

    def __init__(self, recording: Recording, ports: Mapping[str, Port] | None = None) -> None:
        self.board: Board = board_of(recording.header)
        """The board and its settings, as they were in force."""
        self._recording = recording
        self._ports = ports

    @property
    def path(self) -> Path:
        """The file."""
        return self._recording.path

    @property
    def faults(self) -> list[str]:
        """What is not whole in it, one sentence each."""
        return self._recording.faults()

    @property
    def ports(self) -> list[str]:
        """Paths of the ports that it may have values of: inputs of the whole, outputs of models."""
        return [*map(entrance, self._model.in_ports), *self._recording.header.ports]

    def port(self, path: str) -> PortValues[Any]:
        """Return what passed a port, by its path: `controller.yaw.command_n`.

        Of an output port of any model, or an input port of the whole. Raises UnknownName for a
        port that there is not.
        """
        senders = Senders(self._model).of(path)
        if not {*senders} <= {*self.ports}:
            raise UnknownName.of("port", path, self.ports)
        sent = [(each.at, each.value) for each in self._sent if each.port in senders]
        return PortValues(path, self._kind(senders[0]), sent)

    def values(self) -> dict[str, PortValues[Any]]:
        """Return what passed each port that sent or took anything, by its path."""
        found: dict[str, PortValues[Any]] = {}
        for at, path, value in self._sent:
            if path not in found:
                found[path] = PortValues(path, self._kind(path))
            found[path].take(at, value)
        return found

    def to_dataframe(self) -> Any:  # noqa: ANN401 -- as `PortValues.to_dataframe`
        """Return all of it as one table, a row for each instant at which a port sent something.

        A column is called by port and field, such as `imu.sample.rate.2`. It is a DataFrame of
        pandas, or without pandas a Table of pyarrow. Raises ConfigError without either.
        """
        return table_of(self.values())

    def __repr__(self) -> str:
        first, last = (at / SECOND for at in span_of(self._recording))
        return f"<RecordedRun of {self.board.name}: {first:g} s to {last:g} s, {self.path}>"

    def _kind(self, path: str) -> str:
        """The name of a port's type; `values` for one of a world that is not at hand."""
        entrances = {entrance(name): port for name, port in self._model.in_ports.items()}
        port = self._typed.get(path) or entrances.get(path)
        return "values" if port is None else port.type.__name__

    @cached_property
    def _typed(self) -> Mapping[str, Port]:
        return ports_of(self._model) if self._ports is None else self._ports

    @cached_property
    def _model(self) -> Coupled:
        return model_of(self._recording.header, self.board)

    @cached_property
    def _sent(self) -> list[Sent]:
        return list(passed(self._recording, self.board, ports=self._typed))


def open_recording(run: str | PathLike[str]) -> RecordedRun:
    """Return a recorded run: a recording's file, a board's last run, or a name of one that is kept.

    Raises ConfigError if there is none, or it cannot be read.
    """
    return RecordedRun(read_recording(find_recording(fspath(run))))
