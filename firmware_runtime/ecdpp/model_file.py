"""Coupled models from E-CD++ model files (`.ma`).

`components` names coupled models, which have a section of their own, and atomic ones as
`name@Class`, which may have one for their parameters. `components`, `in` and `out` may be given
more than once. Models and coupled ports are called as `components`, `in` and `out` write them,
ports of an atomic model as its class declares them.

The file gives ports no types: a coupled model's port takes the type of what it is linked to, or
float if it is linked to nothing.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.ecdpp.model_links import declare_ports, draw_links
from firmware_runtime.ecdpp.model_syntax import Entry, Section, parse_sections
from firmware_runtime.ecdpp.text import look_up, parse_number, parse_time, read_text
from firmware_runtime.errors import ConfigError

TOP = "top"
"""The section of the model that all others are part of."""
DEEPEST = 64
"""Coupled models within each other."""


def read_model(path: Path, classes: Mapping[str, AtomicClass]) -> Coupled:
    """The file's top model, of these atomic classes; raises ConfigError with every fault found."""
    return parse_model(read_text(path), str(path), classes)


def parse_model(text: str, source: str, classes: Mapping[str, AtomicClass]) -> Coupled:
    """The text's top model; `source` names it in a ConfigError."""
    faults: list[str] = []
    sections = parse_sections(text, faults)
    if TOP not in sections:
        raise ConfigError(source, [*faults, f"no section [{TOP}]"])
    builder = _Builder(sections, classes, faults)
    model = builder.coupled(sections[TOP], sections[TOP].name)
    builder.note_unused()
    if faults:
        raise ConfigError(source, faults)
    return model


class _Builder:
    """Turns sections into models and notes what cannot be."""

    def __init__(
        self,
        sections: Mapping[str, Section],
        classes: Mapping[str, AtomicClass],
        faults: list[str],
    ) -> None:
        self._sections = sections
        self._classes = classes
        self._faults = faults
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
            self._fault(entry.line, f"{entry.key!r}: a coupled model has no parameters")
        return model

    def note_unused(self) -> None:
        """Every section must be a component of some model."""
        for name, section in self._sections.items():
            if name not in self._used:
                self._fault(section.line, f"[{section.name}] is no model's component")

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
            known = ", ".join(self._classes)
            raise ValueError(f"unknown class {entry.value!r}; expected one of {known}")
        if section and section.is_coupled:
            raise ValueError(f"section [{section.name}] describes a coupled model, not an atomic")
        arguments = self._arguments(section.parameters if section else (), atomic_class)
        return atomic_class.build(entry.key, **arguments)

    def _arguments(self, entries: Sequence[Entry], atomic_class: AtomicClass) -> dict[str, float]:
        arguments: dict[str, float] = {}
        for entry in entries:
            time_name = look_up(atomic_class.times, entry.key)
            number_name = look_up(atomic_class.numbers, entry.key)
            value = parse_time(entry.value) if time_name else parse_number(entry.value)
            name = time_name or number_name
            if name is None:
                known = ", ".join((*atomic_class.times, *atomic_class.numbers)) or "none"
                self._fault(entry.line, f"unknown parameter {entry.key!r}; expected one of {known}")
            elif value is None:
                expected = "HH:MM:SS:ms" if time_name else "a number"
                self._fault(entry.line, f"{entry.key} {entry.value!r}: expected {expected}")
            elif name in arguments:
                self._fault(entry.line, f"{entry.key}: given twice")
            else:
                arguments[name] = value
        return arguments

    def _fault(self, line: int, sentence: str) -> None:
        self._faults.append(f"line {line}: {sentence}")
