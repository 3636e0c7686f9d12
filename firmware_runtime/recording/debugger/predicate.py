"""Predicates: `imu.fault` when that port sends, `controller.yaw.command_n > 0.5` when it holds.

Of Python's expressions: names of models with ports, fields and attributes, numbers and texts,
comparisons, `and`, `or`, `not`, `abs(...)`, signs and places in square brackets. Nothing is called.
A member of an enumeration goes by its name: `mode == "WATERING"`.
"""

import ast
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from keyword import iskeyword
from typing import Any, Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.debugger.model_state import Models, value_of
from firmware_runtime.recording.records import fields_of

_QUOTED: Final = "\"[^\"]*\"|'[^']*'"
_STAND_IN: Final = "_path_{}_"


def parsed(text: str, models: Models) -> ast.expr:
    """The expression, with the paths of models and ports as names. Raises SyntaxError, ValueError.

    What is in quotes is left as it is; of two paths that begin alike the longer one is meant.
    """
    paths = sorted(set(_odd_paths(models)), key=len, reverse=True)
    if not paths:
        return ast.parse(text, mode="eval").body
    any_of_them = "|".join(map(re.escape, paths))
    found = re.sub(
        rf"(?P<quoted>{_QUOTED})|(?<![\w.])(?P<path>{any_of_them})(?!\w)",
        lambda each: each["quoted"] or _STAND_IN.format(paths.index(each["path"])),
        text,
    )
    meant = {_STAND_IN.format(number): path for number, path in enumerate(paths)}
    expression = ast.parse(found, mode="eval").body
    for node in ast.walk(expression):
        if isinstance(node, ast.Name):
            node.id = meant.get(node.id, node.id)
    return expression


def _odd_paths(models: Models) -> Iterator[str]:
    """Paths of models and output ports in which a word is no name of Python's; numbers stay."""
    for path, component in models.by_path.items():
        for each in (path, *(f"{path}.{name}" for name in component.out_ports)):
            words = each.split(".")
            if not each.isdecimal() and not all(map(_is_name, words)):
                yield each


def _is_name(word: str) -> bool:
    return word.isidentifier() and not iskeyword(word)


def may_have(kind: type[object], name: str) -> bool:
    """Return whether a value of this class can have an attribute: a field, or what a class has."""
    return any(name in fields_of(each) or hasattr(each, name) for each in _with_derived(kind))


def _with_derived(kind: type[object]) -> Iterator[type[object]]:
    yield kind
    for each in kind.__subclasses__():
        yield from _with_derived(each)


_COMPARE: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_EXPECTED: Final = "expected such as `sensor.fault` or `controller.pid.command_n > 0.5`"
_LONGEST: Final = 1000

Term = Callable[["Seen"], Any]


class Seen:
    """Values that a predicate looks at: the last of each port, and which have just sent."""

    def __init__(self) -> None:
        self.last: Mapping[str, object] = {}
        self.sent: set[str] = set()


class NoValue:
    """Value of a port that has sent nothing so far: no comparison with it holds."""


class Predicate:
    """`holds` says whether it does; `of_sending` whether it is about what is being sent."""

    def __init__(self, text: str, models: Models) -> None:
        self.text = text
        self.of_sending = False
        self._models = models
        if len(text) > _LONGEST:
            raise self._refused("it is too long")
        try:
            self._term = self._condition(parsed(text.strip(), models))
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise self._refused(f"not understood ({error})") from error

    def holds(self, seen: Seen) -> bool:
        """Return whether it holds now; where something has no value to compare, it does not."""
        try:
            return bool(self._term(seen))
        except (TypeError, ValueError, ConfigError, IndexError, KeyError):
            return False

    def _condition(self, node: ast.expr) -> Term:
        """Compile a condition: the name of a port means that it sends."""
        if isinstance(node, ast.BoolOp):
            terms = [self._condition(each) for each in node.values]
            if isinstance(node.op, ast.And):
                return lambda seen: all(each(seen) for each in terms)
            return lambda seen: any(each(seen) for each in terms)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            inner = self._condition(node.operand)
            return lambda seen: not inner(seen)
        if isinstance(node, ast.Compare):
            return self._comparison(node)
        port, rest = self._port(node)
        if port is not None and not rest:
            self.of_sending = True
            return lambda seen: port in seen.sent
        return self._value(node)

    def _comparison(self, node: ast.Compare) -> Term:
        terms = [self._value(each) for each in (node.left, *node.comparators)]
        if unknown := [each for each in node.ops if type(each) not in _COMPARE]:
            raise self._refused(f"{type(unknown[0]).__name__} is no comparison of values")
        compare = [_COMPARE[type(each)] for each in node.ops]

        def holds(seen: Seen) -> bool:
            values = [each(seen) for each in terms]
            if any(each is NoValue for each in values):
                return False
            pairs = zip(compare, values, values[1:], strict=False)
            return all(bool(compared(*_by_name(one, other))) for compared, one, other in pairs)

        return holds

    def _value(self, node: ast.expr) -> Term:
        if isinstance(node, ast.Constant) and isinstance(
            node.value, bool | int | float | str | None
        ):
            constant = node.value
            return lambda _: constant
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            inner, sign = self._value(node.operand), -1 if isinstance(node.op, ast.USub) else 1
            return lambda seen: sign * inner(seen)
        if isinstance(node, ast.Call):
            return self._absolute(node)
        if isinstance(node, ast.Subscript):
            inner, place = self._value(node.value), self._value(node.slice)
            return lambda seen: inner(seen)[place(seen)]
        if isinstance(node, ast.Attribute) and _dotted(node) is None:
            inner, name = self._value(node.value), node.attr
            return lambda seen: value_of(inner(seen), [name], self.text)
        return self._named(node)

    def _absolute(self, node: ast.Call) -> Term:
        is_abs = isinstance(node.func, ast.Name) and node.func.id == "abs"
        if not is_abs or len(node.args) != 1 or node.keywords:
            raise self._refused("only abs(...) can be called")
        inner = self._value(node.args[0])
        return lambda seen: abs(inner(seen))

    def _named(self, node: ast.expr) -> Term:
        """The last value of a port, a field of it, or an attribute of a model."""
        port, rest = self._port(node)
        if port is not None:
            if rest:
                self._check_field(port, rest[0])
            return lambda seen: _field(seen.last.get(port, NoValue), rest, self.text)
        path = _dotted(node)
        assert path is not None  # noqa: S101 -- `_port` has refused what is no name
        name, words = self._models.split(path)
        if not words:
            raise self._refused(f"{path} is a model; expected a port or an attribute of it")
        models = self._models.by_path
        found = value_of(models[name], words[:1], path)
        if isinstance(found, InPort) and not isinstance(models[name], Atomic):
            raise self._refused(f"{path} passes on what enters, and keeps nothing to look at")
        return lambda _: value_of(models[name], words, path)

    def _check_field(self, path: str, field: str) -> None:
        """Refuse a field that no record which leaves this port can have: it would never hold."""
        owner, _, name = path.rpartition(".")
        kind = self._models.component(owner).out_ports[name].type
        known = fields_of(kind)
        if known and not may_have(kind, field):
            fault = f"a {kind.__name__} has no {field}; expected one of {', '.join(known)}"
            raise ConfigError.of_one(path, fault)

    def _port(self, node: ast.expr) -> tuple[str | None, list[str]]:
        """The port that sends what leaves the one a name begins with, and what follows it."""
        path = _dotted(node)
        if path is None:
            if isinstance(node, ast.Subscript | ast.Constant | ast.Attribute | ast.Call):
                return None, []
            raise self._refused(f"{ast.unparse(node)}: not understood")
        name, words = self._models.split(path)
        if words and words[0] in self._models.by_path[name].out_ports:
            return self._models.sender(name, words[0]), words[1:]
        return None, []

    def _refused(self, why: str) -> ConfigError:
        return ConfigError.of_one(f"{self.text[:80]!r}", f"{why}; {_EXPECTED}")


def _by_name(one: object, other: object) -> tuple[object, object]:
    """A member of an enumeration beside a text is its name."""
    if type(other) is str and isinstance(one, Enum):
        return one.name, other
    if type(one) is str and isinstance(other, Enum):
        return one, other.name
    return one, other


def _field(value: object, words: list[str], path: str) -> object:
    return value if value is NoValue or not words else value_of(value, words, path)


def _dotted(node: ast.expr) -> str | None:
    """A name with dots; None for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (before := _dotted(node.value)) is not None:
        return f"{before}.{node.attr}"
    return None
