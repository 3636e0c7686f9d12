"""Coupled models from E-CD++ model files (`.ma`).

`components` names coupled models, which have a section of their own, and atomic ones as
`name@Class` or `name@PACKAGE:Class`, which may have one for their parameters. `components`, `in`
and `out` may be given more than once, and what they list may go on in the next line; a section may
go on further down. What is odd but has a meaning is a warning.

Models and coupled ports are called as `components`, `in` and `out` write them, ports of an atomic
model as its class declares them.

The file gives ports no types: a coupled model's port takes the type of what it is linked to, or
float if it is linked to nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.ecdpp.atomic_class import AtomicClass, KnownClasses, Value
from firmware_runtime.ecdpp.file_text import Warnings, look_up, read_text
from firmware_runtime.ecdpp.model_syntax import (
    Entry,
    Section,
    declare_ports,
    draw_links,
    parse_sections,
)
from firmware_runtime.errors import ConfigError, text_of

TOP = "top"
"""The section of the model that all others are part of."""
DEEPEST = 64
"""Coupled models within each other."""


@dataclass(frozen=True, slots=True)
class Made:
    """Origin of an atomic model: its class, and the arguments of the file."""

    of: AtomicClass
    arguments: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class FileModel:
    """The model of a file, and how each of its atomic models was made, by its path."""

    model: Coupled
    made: dict[str, Made] = field(default_factory=dict)


def read_model(
    path: Path, classes: Mapping[str, AtomicClass], warnings: Warnings | None = None
) -> Coupled:
    """The file's top model, of these atomic classes; raises ConfigError with every fault found."""
    warnings = warnings or Warnings()
    return parse_file(read_text(path, warnings), str(path), classes, warnings).model


def parse_model(text: str, source: str, classes: Mapping[str, AtomicClass]) -> Coupled:
    """The text's top model; `source` names it in a ConfigError."""
    return parse_file(text, source, classes).model


def parse_file(
    text: str,
    source: str,
    classes: Mapping[str, AtomicClass],
    warnings: Warnings | None = None,
) -> FileModel:
    """The text's top model and how it was made; `source` names it in a ConfigError."""
    faults: list[str] = []
    warnings = warnings or Warnings()
    sections = parse_sections(text, faults, warnings)
    if TOP not in sections:
        raise ConfigError(source, [*faults, f"no section [{TOP}]"])
    builder = _Builder(sections, classes, faults, warnings)
    model = builder.coupled(sections[TOP], sections[TOP].name)
    builder.note_unused()
    if faults:
        raise ConfigError(source, faults)
    return FileModel(model, {atomic.path: made for atomic, made in builder.made})


class _Builder:
    """Turns sections into models and notes what cannot be."""

    def __init__(
        self,
        sections: Mapping[str, Section],
        classes: Mapping[str, AtomicClass],
        faults: list[str],
        warnings: Warnings,
    ) -> None:
        self._sections = sections
        self._classes = classes
        self._faults = faults
        self._warnings = warnings
        self.made: list[tuple[Atomic, Made]] = []
        self._used: set[str] = set()
        self._depth = 0

    def coupled(self, section: Section, name: str) -> Coupled:
        """A coupled model with all its parts. Raises ValueError when it lies too deep."""
        self._used.add(name.casefold())
        if self._depth == DEEPEST:
            raise ValueError(f"within {DEEPEST} others; expected fewer")
        model = Coupled(name)
        self._depth += 1
        for entry in section.components:
            self._add(model, entry)
        self._depth -= 1
        for line, fault in (*declare_ports(model, section), *draw_links(model, section)):
            self._fault(line, fault)
        for entry in section.parameters:
            self._warnings.note(entry.line, entry.key, "a coupled model has no parameters")
        return model

    def note_unused(self) -> None:
        """Note the sections that are no component of any model."""
        for name, section in self._sections.items():
            if name not in self._used:
                self._warnings.note(section.line, f"[{section.name}]", "no model's component")

    # Components ---------------------------------------------------------------------------------

    def _add(self, model: Coupled, entry: Entry) -> None:
        if entry.key.casefold() in self._used:
            self._fault(entry.line, f"component {entry.key!r}: declared twice in this file")
            return
        try:
            model.add(self._component(entry, self._sections.get(entry.key.casefold())))
        except (ValueError, ModelError) as error:
            self._fault(entry.line, f"component {entry.key!r}: {error}")

    def _component(self, entry: Entry, section: Section | None) -> Component:
        if entry.value:
            return self._atomic(entry, section)
        if section is None:
            raise ValueError(f"expected {entry.key}@Class, or a section [{entry.key}]")
        return self.coupled(section, entry.key)

    def _atomic(self, entry: Entry, section: Section | None) -> Atomic:
        self._used.add(entry.key.casefold())
        atomic_class = look_up(self._classes, entry.value)
        if atomic_class is None:
            raise ValueError(self._unknown(entry.value))
        if section and section.is_coupled:
            raise ValueError(f"section [{section.name}] describes a coupled model, not an atomic")
        arguments = self._arguments(section.parameters if section else (), atomic_class)
        atomic = _constructed(atomic_class, entry.key, arguments)
        self.made.append((atomic, Made(atomic_class, arguments)))
        return atomic

    def _unknown(self, name: str) -> str:
        """Return why a class has no meaning here, in a sentence."""
        if isinstance(self._classes, KnownClasses) and (
            several := look_up(self._classes.clashes, name)
        ):
            return f"class {name!r} is in several packages; expected {' or '.join(several)}"
        known = ", ".join(each for each in self._classes if ":" not in each)
        missing = "".join(f"; {each}" for each in getattr(self._classes, "missing", ()))
        expected = f"one of {known}" if known else "a class of an installed package: none has any"
        return f"unknown class {name!r}; expected {expected}{missing}"

    def _arguments(self, entries: Sequence[Entry], atomic_class: AtomicClass) -> dict[str, Value]:
        arguments: dict[str, Value] = {}
        parameters = atomic_class.parameters
        for entry in entries:
            parameter = look_up(parameters, entry.key)
            if parameter is None:
                known = ", ".join(parameters) or "none"
                self._fault(entry.line, f"unknown parameter {entry.key!r}; expected one of {known}")
            elif parameter.keyword in arguments:
                self._fault(entry.line, f"{entry.key}: given twice")
            else:
                try:
                    arguments[parameter.keyword] = parameter.value(entry.value)
                except ValueError as error:
                    self._fault(entry.line, str(error))
        return arguments

    def _fault(self, line: int, sentence: str) -> None:
        self._faults.append(f"line {line}: {sentence}")


def _constructed(atomic_class: AtomicClass, name: str, arguments: Mapping[str, Value]) -> Atomic:
    """The atomic model; whatever its constructor raises is a ValueError with a sentence."""
    try:
        atomic = atomic_class.build(name, **arguments)
    except (ValueError, ModelError):
        raise
    except Exception as error:
        raise ValueError(f"{type(error).__name__}: {text_of(error)}") from error
    if not isinstance(atomic, Atomic):
        raise ValueError(f"its class makes {type(atomic).__name__}; expected an atomic model")  # noqa: TRY004 -- a fault of the file's, as any other
    return atomic
