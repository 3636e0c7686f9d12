"""Names in a board's definition that lead nowhere: `check` reports them.

A definition names ports of the model (experiments, the plant), keys of board.toml (experiments,
gains) and modules. None of it keeps the robot from running, so none is a fault of its file.
"""

from collections.abc import Iterator
from importlib.util import find_spec
from types import NoneType
from typing import get_args, get_origin, get_type_hints

from msgspec import Struct, structs

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.configuration import find_out_port
from firmware_runtime.board.ends import end_of, ends_of
from firmware_runtime.board.experiments import (
    Experiment,
    OwnExperiment,
    Plant,
    Signal,
    StepExperiment,
)
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import retunable_values
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.board.variants import is_struct
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.part import part_of
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.links.cut.cut import cut_of
from firmware_runtime.recording.records import fields_of
from firmware_runtime.runs.start import start_session


def unknown_names(board: Board) -> Iterator[str]:
    """A sentence for each name of the definition that leads nowhere."""
    defined = kinds.definition(board.kind)
    for pattern in board.retunable:
        if not may_have(defined.settings, pattern):
            yield f"retunable: {pattern!r}: no file of this board has such a key"
    known = {*board.unconnected().model.components, *defined.optional_components}
    yield from (
        f"retunable: {name!r}: no component of this board is called so"
        for name in board.gains
        if name not in known
    )
    for name, experiment in board.experiments.items():
        yield from (f"experiments.{name}.{why}" for why in _of_experiment(board, experiment))
    if board.plant is not None:
        yield from (f"plant.{why}" for why in _of_plant(board, board.plant))
    yield from _what_cannot_cross(board)


def _of_experiment(board: Board, experiment: Experiment) -> Iterator[str]:
    try:
        tried = registry.load(str(board.source), [*board.assignments, *experiment.assignments])
    except ConfigError as error:
        yield from (f"settings: {fault}" for fault in error.faults)
        return
    if isinstance(experiment, OwnExperiment):
        module = experiment.run.partition(":")[0]
        if not _is_there(module):
            yield f"run: no module {module}; expected it in an installed package"
    if isinstance(experiment, StepExperiment) and has_rig(tried):
        try:
            model = _model_on_doubles(tried)
        except FirmwareRuntimeError as error:
            yield f"settings: {error}"
        else:
            yield from _of_step(model, experiment)


def _of_step(model: Component, experiment: StepExperiment) -> Iterator[str]:
    port = model.in_ports.get(experiment.port)
    if port is None:
        known = ", ".join(model.in_ports) or "none: the model has no input port"
        yield f"port: {experiment.port!r}: no input port of the top model; expected one of {known}"
    elif port.type not in {float, int}:
        expected = "expected one of numbers, which a step is made of"
        yield f"port: {experiment.port!r}: takes a {port.type.__name__}; {expected}"
    answer = [("answer", experiment.answer)] if experiment.answer else []
    for key, path in (*answer, *(("beside", each) for each in experiment.beside.values())):
        if find_out_port(model, path) is None:
            yield f"{key}: {path!r}: the model on its doubles has no such output port"


def _of_plant(board: Board, plant: Plant) -> Iterator[str]:
    model = board.unconnected().model
    for key, signal in (("input", plant.input), ("output", plant.output)):
        yield from (f"{key}: {why}" for why in _of_signal(model, signal))
    if plant.loop is not None:
        known = retunable_values(board.settings, board.retunable)
        for key in ("kp", "ki", "kd"):
            named = getattr(plant.loop, key)
            if named not in known:
                expected = f"expected one of {', '.join(known)}"
                yield f"loop.{key}: {named!r}: no gain of this board; {expected}"


def _of_signal(model: Component, signal: Signal) -> Iterator[str]:
    found = [port for path in signal.ports if (port := find_out_port(model, path)) is not None]
    if not found:
        yield f"{', '.join(signal.ports)}: the model has no such output port"
    for port in found:
        fields = fields_of(port.type)
        for place in signal.terms:
            first = place.partition(".")[0]
            if fields and first not in fields:
                expected = f"expected one of {', '.join(fields)}"
                yield f"{place!r}: a {port.type.__name__} has no such number; {expected}"


def _what_cannot_cross(board: Board) -> Iterator[str]:
    """Ports at the cut whose values no link carries: stages of two ends are refused."""
    if not board.settings.roles:
        return
    try:
        role = next(iter(ends_of(board).values()))
    except ConfigError:
        return  # not two ends: reported where they are wanted
    end = end_of(board, role)
    try:
        cut_of(part_of(board.unconnected().model, end.components), end.crossings)
    except ConfigError as error:
        yield from error.faults


def _model_on_doubles(board: Board) -> Component:
    """The model with the world that its rig adds."""
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    try:
        return session.robot.model
    finally:
        session.close()


def _is_there(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


ANY = "*"
"""In the place of a table's name that the file chooses."""


def may_have(schema: type[Struct], pattern: str) -> bool:
    """Return whether a file of this schema may have a key like `controller.*.kp`."""
    wanted = pattern.split(".")
    return any(
        len(key) == len(wanted)
        and all(ANY in {word, want} or word == want for word, want in zip(key, wanted, strict=True))
        for key in _keys(schema)
    )


def _keys(type_: object) -> Iterator[tuple[str, ...]]:
    """The words of each key below a type; one empty key of a type that is no table."""
    if is_struct(type_):
        hints = get_type_hints(type_, include_extras=True)
        for field in structs.fields(type_):
            for below in _keys(hints[field.name]):
                yield (field.encode_name, *below)
    elif get_origin(type_) is dict:
        for below in _keys(get_args(type_)[1]):
            yield (ANY, *below)
    elif tables := [each for each in get_args(type_) if is_struct(each)]:
        for each in tables:
            yield from _keys(each)
        if any(
            each not in {*tables, NoneType} for each in get_args(type_) if isinstance(each, type)
        ):
            yield ()
    else:
        yield ()
