"""Names for Python source: of imports, classes, variables and attributes, none taken twice."""

import builtins
import keyword
import re
from collections import defaultdict
from collections.abc import Iterable
from importlib import import_module
from unicodedata import normalize

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import Owner

WIDEST = 100
"""Characters of a line."""
_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def snake_case(name: str) -> str:
    """`radarController` as `radar_controller`; never a keyword, a builtin or a number."""
    found = _spelled(re.sub(r"_+", "_", _HUMP.sub("_", name.replace("-", "_"))).lower())
    if not found.isidentifier():
        found = f"_{found}"
    return f"{found}_" if keyword.iskeyword(found) or hasattr(builtins, found) else found


def camel_case(name: str) -> str:
    """`radar_system` as `RadarSystem`, `BUF-PROC` as `BufProc`."""
    parts = [part.lower() if part.isupper() else part for part in re.split("[_-]", name)]
    found = _spelled("".join(part[:1].upper() + part[1:] for part in parts)) or "Model"
    return found if found.isidentifier() and not keyword.iskeyword(found) else f"Model{found}"


def _spelled(word: str) -> str:
    """As Python reads it within a name: `ﬁ` is `fi`, a sign that no name has is `_`."""
    return "".join(each if f"_{each}".isidentifier() else "_" for each in normalize("NFKC", word))


class Names:
    """Names within one class or function."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = set(taken)
        self._of: dict[int, str] = {}

    @classmethod
    def beside(cls, imports: "Imports") -> "Names":
        """For variables of `__init__`: none may hide a class that is called in it."""
        return cls({"self", "name", "super", *imports.taken})

    @classmethod
    def of_ports(cls, model: Coupled) -> "Names":
        """For ports as attributes: what a coupled model has already is taken."""
        return cls(dir(Coupled) + list(vars(Coupled("model"))) + list(vars(model)))

    def new(self, name: str) -> str:
        """A name that is free, like this one."""
        wanted = snake_case(name)
        while wanted in self._taken:
            wanted += "_"
        self._taken.add(wanted)
        return wanted

    def of(self, owner: Owner) -> str:
        """The variable of a component, from now on."""
        return self._of.setdefault(id(owner), self.new(owner.name))

    def known(self, owner: Owner) -> str | None:
        """The variable of a component, None for what is none."""
        return self._of.get(id(owner))


class Imports:
    """Imports of the source, and the names of its own classes."""

    def __init__(self) -> None:
        self._modules: defaultdict[str, dict[str, str]] = defaultdict(dict)
        self.taken: set[str] = set()

    def add(self, module: str, name: str) -> str:
        """Import a name; returns what it is called here."""
        names = self._modules[module]
        if name not in names:
            names[name] = self._free(name)
        return names[name]

    def name_of(self, thing: object) -> str:
        """Return the name of a class or function here. Raises ValueError if none can import it."""
        module = getattr(thing, "__module__", "")
        name = getattr(thing, "__qualname__", repr(thing))
        if module == "builtins":
            return str(name)
        try:
            found = getattr(import_module(module), name, None)
        except (ImportError, ValueError):
            found = None
        if found is not thing:
            raise ValueError(f"{module}.{name} cannot be imported; expected a name of a module")
        return self.add(module, name)

    def free_class_name(self, name: str) -> str:
        """A name for a class of the source's own."""
        return self._free(camel_case(name))

    def lines(self) -> str:
        """The statements, in alphabetical order."""
        return "".join(
            f"{_statement(module, names)}\n" for module, names in sorted(self._modules.items())
        )

    def _free(self, name: str) -> str:
        wanted, number = name, 2
        while wanted in self.taken:
            wanted, number = f"{name}{number}", number + 1
        self.taken.add(wanted)
        return wanted


def _statement(module: str, names: dict[str, str]) -> str:
    listed = [name if name == alias else f"{name} as {alias}" for name, alias in names.items()]
    # Constants before classes, as isort has it
    listed.sort(key=lambda each: (not each.split()[0].isupper(), each))
    statement = f"from {module} import {', '.join(listed)}"
    if len(statement) <= WIDEST:
        return statement
    return "\n".join([f"from {module} import (", *(f"    {each}," for each in listed), ")"])
