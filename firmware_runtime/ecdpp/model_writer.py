"""Model files (`.ma`) from coupled models, such that reading the file gives the same model.

What the format has no word for is refused, all of it at once: a class that no file may name, a
`select` of one's own, a name that is no word, names that differ by case alone, a duration finer
than a millisecond.
"""

from collections.abc import Iterable, Iterator, Mapping

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.ecdpp.atomic_class import AtomicClass
from firmware_runtime.ecdpp.model_file import TOP, parse_model
from firmware_runtime.ecdpp.model_syntax import WORD
from firmware_runtime.errors import ConfigError


def model_text(model: Coupled, classes: Mapping[str, AtomicClass]) -> str:
    """The model as a file. Raises ConfigError with everything that no file can say."""
    faults: list[str] = []
    parts = list(with_all_below(model))
    _check_names(parts, faults)
    sections = [_section(part, model, classes, faults) for part in parts]
    if faults:
        raise ConfigError(model.path, faults)
    text = "\n".join("\n".join(lines) + "\n" for lines in sections if lines)
    _check_reading(text, model, classes)
    return text


def _check_names(parts: Iterable[Component], faults: list[str]) -> None:
    """A file has one section a model, whatever it is part of."""
    places: dict[str, str] = {}
    for part in parts:
        name = part.name if part.parent else TOP
        first = places.setdefault(name.casefold(), part.path)
        if first != part.path:
            faults.append(f"{part.path}: {first} is called so too; expected names of their own")
        ports = (part.in_ports, part.out_ports)
        faults += [
            f"{part.path}: {word!r}: expected letters, digits, - and _"
            for word in (name, *(each for names in ports for each in names))
            if not WORD.fullmatch(word)
        ]
        faults += [
            f"{part.path}: port {twin!r} differs from another by case alone"
            for names in ports
            for twin in _twins(names)
        ]


def _twins(names: Iterable[str]) -> Iterator[str]:
    seen: set[str] = set()
    for name in names:
        if name.casefold() in seen:
            yield name
        seen.add(name.casefold())


def _section(
    part: Component, top: Coupled, classes: Mapping[str, AtomicClass], faults: list[str]
) -> list[str]:
    """The lines of a model's section; none for an atomic model without parameters."""
    if isinstance(part, Coupled):
        return list(_coupled(part, TOP if part is top else part.name, classes, faults))
    name = _class_name(part, classes)
    if name is None:
        return []  # said where it is a component
    lines = [f"[{part.name}]"]
    for parameter in classes[name].parameters.values():
        try:
            value = getattr(part, parameter.keyword)
            lines.append(f"{parameter.key} : {parameter.text(value)}")
        except AttributeError:
            said = f"{part.path}: no attribute {parameter.keyword!r} to write {parameter.key} from"
            faults.append(f"{said}; expected the constructor of {name} to keep it")
        except ValueError as error:
            faults.append(f"{part.path}: {error}")
    return lines if len(lines) > 1 else []


def _coupled(
    model: Coupled, name: str, classes: Mapping[str, AtomicClass], faults: list[str]
) -> Iterator[str]:
    if type(model).select is not Coupled.select:
        faults.append(f"{model.path}: select of its own; expected the order of components")
    yield f"[{name}]"
    for component in model.components.values():
        yield f"components : {_component(component, classes, faults)}"
    for kind, ports in (("in", model.in_ports), ("out", model.out_ports)):
        if ports:
            yield f"{kind} : {' '.join(ports)}"
    for source, end in model.couplings:
        yield f"Link : {_reference(source, model)} {_reference(end, model)}"


def _component(component: Component, classes: Mapping[str, AtomicClass], faults: list[str]) -> str:
    if isinstance(component, Coupled):
        if not (component.components or component.in_ports or component.out_ports):
            faults.append(f"{component.path}: an empty model; expected components or ports")
        return component.name
    name = _class_name(component, classes)
    if name is None:
        made = type(component).__name__
        expected = "expected one that an entry point of firmware_runtime.ma_classes makes known"
        faults.append(f"{component.path}: class {made} is known to no model file; {expected}")
    return f"{component.name}@{name}"


def _class_name(atomic: Component, classes: Mapping[str, AtomicClass]) -> str | None:
    """Return what a file calls the class of an atomic model, None if it has no name for it."""
    return next((name for name, each in classes.items() if each.build is type(atomic)), None)


def _reference(port: AnyPort, model: Coupled) -> str:
    return port.name if port.owner is model else f"{port.name}@{port.owner.name}"


# Reading it back --------------------------------------------------------------------------------


def _check_reading(text: str, model: Coupled, classes: Mapping[str, AtomicClass]) -> None:
    """Raise ConfigError if the file would give another model, such as one with other types."""
    read = parse_model(text, model.path, classes)
    faults = list(_differences(model, read))
    if faults:
        raise ConfigError(model.path, faults)


def _differences(model: Component, read: Component) -> Iterator[str]:
    for port in _ports(model):
        other = next(
            each for each in _ports(read) if (type(each), each.name) == (type(port), port.name)
        )
        if other.type is not port.type:
            said = (
                f"{port.path}: of {port.type.__name__}, by its couplings of {other.type.__name__}"
            )
            yield f"{said}; a model file states no types"
    if isinstance(model, Coupled) and isinstance(read, Coupled):
        for name, component in model.components.items():
            yield from _differences(component, read.components[name])


def _ports(model: Component) -> list[AnyPort]:
    return [*model.in_ports.values(), *model.out_ports.values()]
