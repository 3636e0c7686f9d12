"""Skeletons of the atomic classes that a model file names and no package has.

A skeleton has the ports that the file links, all of numbers, and the parameters that its sections
set; what it does, its author writes: it takes every value in and sends none.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.ecdpp.atomic_class import AtomicClass, Kind, KnownClasses, Value
from firmware_runtime.ecdpp.file_text import Warnings, look_up, parse_number, parse_time
from firmware_runtime.ecdpp.model_syntax import Section, parse_sections
from firmware_runtime.ecdpp.python_names import Names

TYPES: Mapping[Kind, str] = {"time": "int", "number": "float", "whole": "int", "word": "str"}
"""Of the constructor's arguments, by the kind of a parameter."""


class SkeletonModel(Atomic):
    """Atomic model that is passive without end, with these ports as attributes."""

    def __init__(self, name: str, skeleton: "Skeleton", arguments: Mapping[str, Value]) -> None:
        super().__init__(name)
        for port, attribute in skeleton.inputs.items():
            setattr(self, attribute, self.in_port(port, float))
        for port, attribute in skeleton.outputs.items():
            setattr(self, attribute, self.out_port(port, float))
        vars(self).update(arguments)


@dataclass(slots=True, eq=False)
class Skeleton:
    """A class that the file names: `uses` are the models that are of it."""

    name: str
    uses: list[str] = field(default_factory=list)
    inputs: dict[str, str] = field(default_factory=dict)
    """The attribute of each input port, by its name."""
    outputs: dict[str, str] = field(default_factory=dict)
    keywords: dict[str, str] = field(default_factory=dict)
    """The constructor's keyword of each key."""
    texts: dict[str, list[str]] = field(default_factory=dict)
    """What the file has as values of each key."""

    def build(self, name: str, **arguments: Value) -> SkeletonModel:
        """Make a model of this class."""
        return SkeletonModel(name, self, arguments)

    def kind(self, key: str) -> Kind:
        """The kind that all values of a key are of."""
        texts = self.texts[key]
        if all(parse_time(text) is not None for text in texts):
            return "time"
        numbers = [parse_number(text) for text in texts]
        if all(number is not None for number in numbers):
            is_whole = all(number.is_integer() for number in numbers if number is not None)
            return "whole" if is_whole else "number"
        return "word"

    def atomic_class(self) -> AtomicClass:
        """Return what the file is read with."""
        found: defaultdict[Kind, dict[str, str]] = defaultdict(dict)
        for key, keyword in self.keywords.items():
            found[self.kind(key)][key] = keyword
        kinds = (found[each] for each in ("time", "number", "whole", "word"))
        return AtomicClass(self.build, *kinds)

    def defaults(self) -> Iterator[tuple[str, Kind, Value]]:
        """Each keyword, its kind, and the value that the file gives it first."""
        parameters = self.atomic_class().parameters
        for key, keyword in self.keywords.items():
            parameter = parameters[key]
            yield keyword, parameter.kind, parameter.value(self.texts[key][0])


def skeletons_of(text: str, classes: KnownClasses) -> dict[str, Skeleton]:
    """Skeletons by the name of each class of a file that is not known."""
    sections = parse_sections(text, [], Warnings())
    found: dict[str, Skeleton] = {}
    of_model: dict[str, Skeleton] = {}
    for section in sections.values():
        for entry in section.components:
            name = entry.value
            is_known = look_up(classes, name) is not None or name.casefold() in classes.clashes
            if name and ":" not in name and not is_known:
                skeleton = look_up(found, name) or found.setdefault(name, Skeleton(name))
                skeleton.uses.append(entry.key)
                of_model[entry.key.casefold()] = skeleton
    _add_parameters(of_model, sections)
    _add_ports(of_model, [*sections.values()])
    return found


def _add_parameters(of_model: Mapping[str, Skeleton], sections: Mapping[str, Section]) -> None:
    for model, skeleton in of_model.items():
        if model not in sections:
            continue
        for entry in sections[model].parameters:
            known = {key.casefold(): key for key in skeleton.keywords}
            key = known.get(entry.key.casefold(), entry.key)
            if key not in skeleton.keywords:
                skeleton.keywords[key] = _names(skeleton).new(entry.key)
            skeleton.texts.setdefault(key, []).append(entry.value)


def _add_ports(of_model: Mapping[str, Skeleton], sections: Sequence[Section]) -> None:
    for section in sections:
        for link in section.links:
            for reference, side in ((link.source, "outputs"), (link.end, "inputs")):
                skeleton = of_model.get(reference.model_name)
                if skeleton is None:
                    continue
                ports: dict[str, str] = getattr(skeleton, side)
                if look_up(ports, reference.port) is None:
                    ports[reference.port] = _names(skeleton).new(reference.port)


def _names(skeleton: Skeleton) -> Names:
    """Names of attributes and arguments: those of every atomic model are taken."""
    own = [*skeleton.keywords.values(), *skeleton.inputs.values(), *skeleton.outputs.values()]
    return Names([*dir(Atomic), *vars(Atomic("model")), "elapsed", *own])
