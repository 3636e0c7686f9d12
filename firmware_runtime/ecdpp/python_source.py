"""Python source that builds the model of a model file: a class for each coupled model.

The source is for people, who go on with it: one component a line, one wire a line, as in any
model that is written by hand. `python_names` finds the names.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort, InPort
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.atomic_class import AtomicClass, Value, known_classes
from firmware_runtime.ecdpp.file_text import Warnings, read_text
from firmware_runtime.ecdpp.model_file import FileModel, Made, parse_file
from firmware_runtime.ecdpp.python_names import WIDEST, Imports, Names
from firmware_runtime.ecdpp.skeletons import TYPES, Skeleton, skeletons_of
from firmware_runtime.errors import ConfigError


def imported_source(
    path: Path, warnings: Warnings | None = None, *, with_skeletons: bool = False
) -> str:
    """The Python source of a model file, of the classes that are installed. Raises ConfigError.

    With skeletons, a class that is not known is written too, for its author to go on with.
    """
    text = read_text(path, warnings := warnings or Warnings())
    classes = known_classes(file=path)
    skeletons = skeletons_of(text, classes) if with_skeletons else {}
    classes.update({name: each.atomic_class() for name, each in skeletons.items()})
    read = parse_file(text, str(path), classes, warnings)
    return python_source(read, path.name, [*skeletons.values()])


def python_source(read: FileModel, source: str, skeletons: Sequence[Skeleton] = ()) -> str:
    """The source of a model that was read from a file called `source`.

    Raises ConfigError for classes that cannot be imported by their names.
    """
    imports = Imports()
    faults: list[str] = []
    writer = _Writer(read.made, imports, faults)
    bodies = [writer.skeleton_class(each) for each in skeletons]
    bodies += [writer.coupled_class(each) for each in _inner_first(read.model)]
    if faults:
        raise ConfigError(source, faults)
    head = f'"""The model of {_quoted(source)}, as a class for each of its coupled models."""\n'
    return "\n\n".join([f"{head}\n{imports.lines()}", *bodies])


def _quoted(name: str) -> str:
    """A file's name within a docstring, which it may not end."""
    return name.replace("\\", "\\\\").replace('"', '\\"').replace("\0", "\\0")


def _inner_first(model: Coupled) -> Iterator[Coupled]:
    for component in model.components.values():
        if isinstance(component, Coupled):
            yield from _inner_first(component)
    yield model


class _Writer:
    """Writes one class after the other; what cannot be imported is noted as a fault."""

    def __init__(self, made: Mapping[str, Made], imports: Imports, faults: list[str]) -> None:
        self._made = made
        self._imports = imports
        self._faults = faults
        self._coupled = imports.name_of(Coupled)
        self._classes: dict[str, str] = {}
        self._attributes: dict[AnyPort, str] = {}
        self._skeletons: dict[object, str] = {}

    def skeleton_class(self, skeleton: Skeleton) -> str:
        """A class with ports and parameters, which its author goes on with."""
        atomic = self._imports.name_of(Atomic)
        name = self._skeletons[skeleton.build] = self._imports.free_class_name(skeleton.name)
        arguments = [
            f"{keyword}: {TYPES[kind]} = {self._time(value) if kind == 'time' else repr(value)}"
            for keyword, kind, value in skeleton.defaults()
        ]
        ports = (("in_port", skeleton.inputs), ("out_port", skeleton.outputs))
        return "\n".join(
            [
                f"class {name}({atomic}):",
                f'    """A skeleton of {skeleton.name}: it takes every value in and sends none."""',
                "",
                *_signature(["self", "name: str", *arguments]),
                "        super().__init__(name)",
                *(
                    f'        self.{attribute} = self.{kind}("{port}", float)'
                    for kind, attributes in ports
                    for port, attribute in attributes.items()
                ),
                *(f"        self.{keyword} = {keyword}" for keyword in skeleton.keywords.values()),
                "",
                "    def output(self) -> None:",
                '        """Send nothing: no state of it ends by itself yet."""',
                "",
                "    def external(self, elapsed: int) -> None:",
                '        """Take what has come; go on waiting."""',
                '        self.passivate("waiting")',
                "",
            ]
        )

    def coupled_class(self, model: Coupled) -> str:
        """The class of a coupled model whose components have theirs already."""
        name = self._imports.free_class_name(model.name)
        self._classes[model.path] = name
        ports = list(self._ports(model))
        parts = [(each, self._construction(each)) for each in model.components.values()]
        names = Names.beside(self._imports)
        lines = [
            f"class {name}({self._coupled}):",
            f'    """{_contents(model)}"""',
            "",
            f'    def __init__(self, name: str = "{model.name}") -> None:',
            "        super().__init__(name)",
            *ports,
            *(_add(names.of(each), construction) for each, construction in parts),
        ]
        if model.couplings:
            lines += ["", *(self._couple(wire, names) for wire in model.couplings)]
        return "\n".join(lines) + "\n"

    def _ports(self, model: Coupled) -> Iterator[str]:
        taken = Names.of_ports(model)
        ports: list[AnyPort] = [*model.in_ports.values(), *model.out_ports.values()]
        for port in ports:
            kind = "in_port" if isinstance(port, InPort) else "out_port"
            attribute = taken.new(port.name)
            self._attributes[port] = f"self.{attribute}"
            type_name = self._imported(port.type, port.path)
            yield f'        self.{attribute} = self.{kind}("{port.name}", {type_name})'

    def _construction(self, component: Component) -> str:
        if isinstance(component, Coupled):
            return f'{self._classes[component.path]}("{component.name}")'
        made = self._made[component.path]
        stated = [f'"{component.name}"']
        kinds = {each.keyword: each.kind for each in made.of.parameters.values()}
        for keyword, value in made.arguments.items():
            is_time = kinds[keyword] == "time"
            stated.append(f"{keyword}={self._time(value) if is_time else repr(value)}")
        return f"{self._class_of(made.of, component.path)}({', '.join(stated)})"

    def _class_of(self, atomic_class: AtomicClass, place: str) -> str:
        if atomic_class.build in self._skeletons:
            return self._skeletons[atomic_class.build]
        return self._imported(atomic_class.build, place)

    def _imported(self, thing: object, place: str) -> str:
        try:
            return self._imports.name_of(thing)
        except ValueError as error:
            self._faults.append(f"{place}: {error}")
            return "?"

    def _time(self, value: Value) -> str:
        """Ns in the largest unit that has no remainder."""
        ns = int(value)
        if not ns:
            return "0"
        word, unit = ("MILLISECOND", MILLISECOND) if ns % SECOND else ("SECOND", SECOND)
        self._imports.add("firmware_runtime.devs.time", word)
        return word if ns == unit else f"{ns // unit} * {word}"

    def _couple(self, wire: tuple[AnyPort, AnyPort], names: Names) -> str:
        source, end = (self._port(each, names) for each in wire)
        line = f"        self.couple({source}, {end})"
        if len(line) <= WIDEST:
            return line
        return f"        self.couple(\n            {source}, {end}\n        )"

    def _port(self, port: AnyPort, names: Names) -> str:
        own = self._attributes.get(port)
        owner = port.owner
        variable = names.known(owner)
        if own is not None:
            return own if variable is None else own.replace("self", variable, 1)
        kept = (key for key, value in vars(owner).items() if value is port)
        attribute = next((key for key in kept if not key.startswith("_")), None)
        if attribute is not None:
            return f"{variable}.{attribute}"
        ports = "in_ports" if isinstance(port, InPort) else "out_ports"
        return f'{variable}.{ports}["{port.name}"]'


def _signature(arguments: Sequence[str]) -> list[str]:
    line = f"    def __init__({', '.join(arguments)}) -> None:"
    if len(line) <= WIDEST:
        return [line]
    return ["    def __init__(", *(f"        {each}," for each in arguments), "    ) -> None:"]


def _add(variable: str, construction: str) -> str:
    line = f"        {variable} = self.add({construction})"
    if len(line) <= WIDEST:
        return line
    return f"        {variable} = self.add(\n            {construction}\n        )"


def _contents(model: Coupled) -> str:
    """Return what a class's docstring says: its components, as many as fit."""
    names = ", ".join(model.components) or "No component"
    room = WIDEST - len('    """."""')
    return f"{names}." if len(names) <= room else f"{len(model.components)} components."
