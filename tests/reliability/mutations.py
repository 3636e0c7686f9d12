"""Mutations of a module: each is one small change of its source that a test should notice.

A comparison or an operator becomes its neighbour, a condition is turned, a number is one more, a
truth is the other one, a call for its effect is left out. Words are left alone: docstrings,
messages, annotations, and names.
"""

import ast
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from msgspec import Struct

from tests.reliability.called import functions_by_line

_COMPARED: Final[Mapping[type[ast.cmpop], type[ast.cmpop]]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_OPERATED: Final[Mapping[type[ast.operator], type[ast.operator]]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Add,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitOr,
}
_OF_A_PROCESS: Final = frozenset(
    {"sched_setscheduler", "sched_setaffinity", "setpriority", "kill", "killpg", "_afterwards"}
)
"""By its number: with another one they would be done to a process that is none of ours."""
_LEFT_ALONE: Final = frozenset({"cast", "TypeVar", "warn", "_log", "print", *_OF_A_PROCESS})


class Mutant(Struct, frozen=True, order=True):
    """One change: the characters of a file from `begin` to `end` become `text`."""

    path: str
    function: str
    """The function it is in, with its path; empty: it is in none."""
    number: int
    """Of those in its function that read alike, from 1."""
    begin: int
    end: int
    before: str
    text: str
    lines: tuple[int, ...] = ()
    """Those it is in."""

    def __str__(self) -> str:
        """Its name, which stays when lines elsewhere come and go."""
        again = f" ({self.number})" if self.number > 1 else ""
        return f"{self.function or self.path}: {_change(self.before, self.text)}{again}"

    def applied(self, source: str) -> str:
        """Return the source with the change."""
        return source[: self.begin] + self.text + source[self.end :]

    def compiles(self, source: str) -> bool:
        """Return whether there is a module with this change at all."""
        try:
            compile(self.applied(source), self.path, "exec")
        except SyntaxError:
            return False
        return True


def mutants_of(path: str, source: str) -> Iterator[Mutant]:
    """Yield all mutants of a module, in order of the source."""
    tree = ast.parse(source)
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    text = source.encode()
    functions = functions_by_line(path, tree)
    alike: Counter[tuple[str, str]] = Counter()

    def characters(line: int, column: int) -> int:
        return len(text[: starts[line - 1] + column].decode())

    for node, changed in _changes(tree):
        begin = characters(node.lineno, node.col_offset)
        end = characters(node.end_lineno or node.lineno, node.end_col_offset or 0)
        written = ast.unparse(changed)
        if isinstance(node, ast.expr) and not isinstance(node, ast.Constant):
            written = f"({written})"
        before, function = source[begin:end], functions.get(node.lineno, "")
        alike[change := (function, _change(before, written))] += 1
        lines = tuple(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        yield Mutant(path, function, alike[change], begin, end, before, written, lines)


def _change(before: str, text: str) -> str:
    return f"{' '.join(before.split())} -> {' '.join(text.split())}"


def _changes(tree: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    for node in _below(tree):
        if _is_left_alone(node):
            continue
        if isinstance(node, ast.expr | ast.stmt):
            yield from ((node, each) for each in _changed(node))
        yield from _changes(node)


def _is_left_alone(node: ast.AST) -> bool:
    """Return whether nothing below is looked at: types, imports, raised messages, decorators."""
    match node:
        case ast.Raise() | ast.Import() | ast.ImportFrom() | ast.JoinedStr() | ast.Assert():
            return True
        case ast.Call(func=ast.Name(id=name)) | ast.Call(func=ast.Attribute(attr=name)):
            return name in _LEFT_ALONE
        case ast.If(test=ast.Name(id="TYPE_CHECKING")) | ast.keyword(arg="strict"):
            return True
        case ast.AnnAssign(annotation=ast.Name(id="TypeAlias")):
            return True
    return False


def _below(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what is below a node, but no annotation and no decorator."""
    match node:
        case ast.FunctionDef():
            yield from node.args.defaults
            yield from filter(None, node.args.kw_defaults)
            yield from node.body
        case ast.ClassDef():
            yield from node.body
        case ast.AnnAssign():
            yield from () if node.value is None else (node.value,)
        case _:
            yield from ast.iter_child_nodes(node)


def _changed(node: ast.expr | ast.stmt) -> Iterator[ast.AST]:
    yield from _operated(node)
    match node:
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(2.0 * value + 1.0)
        case ast.Expr(value=ast.Call()) if not _is_left_alone(node.value):
            yield ast.Pass()
        case ast.Return(value=ast.Name() | ast.Attribute()):
            yield ast.Return(ast.Constant(None))


def _operated(node: ast.expr | ast.stmt) -> Iterator[ast.AST]:
    match node:
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            for place, op in enumerate(ops):
                changed = [*ops[:place], _COMPARED[type(op)](), *ops[place + 1 :]]
                yield ast.Compare(left, changed, comparators)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATED:
            yield ast.BinOp(left, _OPERATED[type(op)](), right)
        case ast.AugAssign(target=target, op=op, value=value) if type(op) in _OPERATED:
            yield ast.AugAssign(target, _OPERATED[type(op)](), value)
        case ast.BoolOp(op=op, values=values):
            yield ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand
        case ast.IfExp(test=test, body=body, orelse=orelse):
            yield ast.IfExp(test, orelse, body)


def mutants_in(root: Path, rooms: Mapping[str, str]) -> dict[str, list[Mutant]]:
    """Return all mutants by room; a room is a folder below a root."""
    return {
        room: [
            mutant
            for file in sorted((root / folder).rglob("*.py"))
            for mutant in mutants_of(str(file.relative_to(root)), file.read_text(encoding="utf-8"))
        ]
        for room, folder in rooms.items()
    }
