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
from dataclasses import dataclass, field
from typing import NamedTuple

from firmware_runtime.ecdpp.text import Warnings, lines_of

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
        """Whether this is the section's own port of that name."""
        return self.model is None and self.port.casefold() == port.casefold()


class Link(NamedTuple):
    """A coupling and its line's number."""

    line: int
    source: Reference
    end: Reference


@dataclass(slots=True)
class Section:
    """What the file says of one model: a coupled one's make-up, an atomic one's parameters."""

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
        """Whether it says anything that only a coupled model has."""
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
