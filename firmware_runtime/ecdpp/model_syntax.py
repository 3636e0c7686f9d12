"""The lines of a model file, sorted into sections; what they mean, `model_file` finds out.

[top]
components : controller@Controller arm
out : Out1
in : In1 In2
Link : In1 start@controller
Link : angle@controller target@arm

[controller]
waitTime : 00:00:00:010
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import CouplingError
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort
from firmware_runtime.ecdpp.file_text import Warnings, lines_of, look_up

WORD = re.compile(r"[\w-]+")
"""What a name of a model or of a port is: it goes into other files, and into Python source."""
_SECTION = re.compile(r"\[\s*([\w-]+)\s*\]")
_DIRECTIVE = re.compile(r"\s*#\s*(include|macro|beginmacro|endmacro)\b", re.IGNORECASE)
_CELLS = {"cell", "flat"}
"""Values of `type` that make a section a grid of cells."""
_LISTS = {"components", "in", "out"}
"""Keys whose values may go on in the next line."""
_ENTRY = re.compile(r"([\w-]+)\s*:\s*(.*)")


class Entry(NamedTuple):
    """`key : value` and its line's number."""

    line: int
    key: str
    value: str


class Reference(NamedTuple):
    """`port@model`, or a port of the section's own model."""

    port: str
    model: str | None

    @property
    def model_name(self) -> str:
        """The model's name without regard to case, empty for the section's own model."""
        return (self.model or "").casefold()

    def is_own(self, port: str) -> bool:
        """Return whether this is the section's own port of that name."""
        return self.model is None and self.port.casefold() == port.casefold()


class Link(NamedTuple):
    """A coupling and its line's number."""

    line: int
    source: Reference
    end: Reference


@dataclass(slots=True)
class Section:
    """Section of a file on one model: a coupled one's make-up, an atomic one's parameters."""

    line: int
    name: str
    components: list[Entry] = field(default_factory=list)
    """Each component, `key` its name, `value` its class or empty."""
    inputs: list[Entry] = field(default_factory=list)
    """Each input port, `key` its name."""
    outputs: list[Entry] = field(default_factory=list)
    """Each output port, `key` its name."""
    links: list[Link] = field(default_factory=list)
    parameters: list[Entry] = field(default_factory=list)

    @property
    def is_coupled(self) -> bool:
        """True if it says anything that only a coupled model has."""
        return bool(self.components or self.inputs or self.outputs or self.links)


def parse_sections(text: str, faults: list[str], warnings: Warnings) -> dict[str, Section]:
    """The file's sections by name in lower case; lines that fit nowhere become faults.

    As CD++ does, a section that comes again goes on with the first one, and a list goes on in the
    lines that follow.
    """
    sections: dict[str, Section] = {}
    section: Section | None = None
    last: Entry | None = None
    _note_directives(text, faults)
    for number, line in lines_of(text):
        head, entry = _SECTION.fullmatch(line), _ENTRY.fullmatch(line)
        if head:
            last = None
            section = sections.setdefault(head[1].casefold(), Section(number, head[1]))
            if section.line != number:
                why = "the section goes on; it began further up"
                warnings.note(number, f"[{head[1]}] again", why)
        elif entry and section:
            last = Entry(number, entry[1], entry[2])
            _sort(last, section, faults)
        elif section and last and last.key.casefold() in _LISTS:
            warnings.note(number, line, f"the list of {last.key} goes on")
            _sort(Entry(number, last.key, line), section, faults)
        else:
            expected = "[name] or key : value" if section else "a section, such as [top]"
            faults.append(f"line {number}: {line!r}: expected {expected}")
    return sections


def _note_directives(text: str, faults: list[str]) -> None:
    """`#` begins a comment, but not where CD++ would put other lines in its place."""
    for number, line in enumerate(text.split("\n"), start=1):
        if found := _DIRECTIVE.match(line):
            expected = "expected the lines themselves"
            faults.append(f"line {number}: #{found[1]} is not supported; {expected}")


def _sort(entry: Entry, section: Section, faults: list[str]) -> None:
    """Put a line where it belongs in its section."""
    words = entry.value.split()
    kind = entry.key.casefold()
    if kind == "components":
        for word in words:
            name, _, class_name = word.partition("@")
            if _is_word(name, f"line {entry.line}: component", faults):
                section.components.append(Entry(entry.line, name, class_name))
    elif kind in {"in", "out"}:
        ports = section.inputs if kind == "in" else section.outputs
        place = f"line {entry.line}: port"
        ports += [Entry(entry.line, word, "") for word in words if _is_word(word, place, faults)]
    elif kind == "type" and entry.value.casefold() in _CELLS:
        expected = "expected coupled and atomic models only"
        fault = f"[{section.name}] is a grid of cells, which is not supported; {expected}"
        faults.append(f"line {entry.line}: {fault}")
    elif kind != "link":
        section.parameters.append(entry)
    elif len(words) == 2:
        section.links.append(Link(entry.line, _reference(words[0]), _reference(words[1])))
    else:
        faults.append(f"line {entry.line}: Link {entry.value!r}: expected two ports")


def _is_word(name: str, place: str, faults: list[str]) -> bool:
    if WORD.fullmatch(name):
        return True
    faults.append(f"{place} {name!r}: expected letters, digits, - and _")
    return False


def _reference(word: str) -> Reference:
    port, at, model = word.partition("@")
    return Reference(port, model if at else None)


T = TypeVar("T")


def declare_ports(model: Coupled, section: Section) -> Iterator[tuple[int, str]]:
    """Give the model its ports; yields each fault and its line."""
    for is_input, entries in ((True, section.inputs), (False, section.outputs)):
        for entry in entries:
            ports: Mapping[str, AnyPort] = model.in_ports if is_input else model.out_ports
            if look_up(ports, entry.key) is not None:
                yield entry.line, f"port {entry.key!r} is declared twice"
            elif is_input:
                model.in_port(entry.key, _narrowest(_types_ahead(model, section, entry.key)))
            else:
                model.out_port(entry.key, _widest(_types_behind(model, section, entry.key)))


def draw_links(model: Coupled, section: Section) -> Iterator[tuple[int, str]]:
    """Couple the ports; yields each fault and its line."""
    lost = {entry.key.casefold() for entry in section.components} - {
        name.casefold() for name in model.components
    }
    for line, source, end in section.links:
        if {source.model_name, end.model_name} & lost:
            continue  # the component could not be built: that is a fault already
        try:
            model.couple(_source(model, source), _end(model, end))
        except (CouplingError, LookupError) as error:
            yield line, f"Link: {error.args[0]}"


# From references to ports -----------------------------------------------------------------------


def _source(model: Coupled, reference: Reference) -> InPort[object] | OutPort[object]:
    if reference.model is None:
        return _named(model.in_ports, reference.port, f"an input of {model.name}")
    component = _component(model, reference.model)
    return _named(component.out_ports, reference.port, f"an output of {component.name}")


def _end(model: Coupled, reference: Reference) -> InPort[object] | OutPort[object]:
    if reference.model is None:
        return _named(model.out_ports, reference.port, f"an output of {model.name}")
    component = _component(model, reference.model)
    return _named(component.in_ports, reference.port, f"an input of {component.name}")


def _component(model: Coupled, name: str) -> Component:
    return _named(model.components, name, f"a component of {model.name}")


def _named(known: Mapping[str, T], name: str, what: str) -> T:
    found = look_up(known, name)
    if found is None:
        raise LookupError(f"{name!r} is not {what}; expected one of {', '.join(known) or 'none'}")
    return found


# The types that coupled ports take --------------------------------------------------------------


def _types_ahead(model: Coupled, section: Section, name: str) -> list[type]:
    """Types of the components' ports that this input is linked to.

    Of an output of the model itself, the types that components bring there.
    """
    ends = [link.end for link in section.links if link.source.is_own(name)]
    own = [end.port for end in ends if end.model is None]
    through = [each for port in own for each in _types_behind(model, section, port)]
    return _types(model, [end for end in ends if end.model], _end) + through


def _types_behind(model: Coupled, section: Section, name: str) -> list[type]:
    """Types of the components' ports, and of the model's own inputs, linked to this output."""
    sources = [link.source for link in section.links if link.end.is_own(name)]
    return _types(model, sources, _source)


def _types(
    model: Coupled,
    references: Sequence[Reference],
    find: Callable[[Coupled, Reference], AnyPort],
) -> list[type]:
    types: list[type] = []
    for reference in references:
        with suppress(LookupError):  # reported when the link is drawn
            types.append(find(model, reference).type)
    return types


def _narrowest(types: Sequence[type]) -> type:
    """The type that fits all the others; without one, coupling will say what does not fit."""
    fitting = [one for one in types if all(issubclass(one, other) for other in types)]
    return (fitting or [*types, float])[0]


def _widest(types: Sequence[type]) -> type:
    """The type that all the others fit."""
    fitting = [one for one in types if all(issubclass(other, one) for other in types)]
    return (fitting or [*types, float])[0]
