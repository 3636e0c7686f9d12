"""Reading a recording calls nothing: what it can reach is a closed list of plain types."""

import builtins
import gc
import sys
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.recording import records, value_reader, value_writer, values
from firmware_runtime.recording.blackbox.state import differences, rows
from firmware_runtime.recording.blackbox.state.keyframes import ForeignState, StateTable
from firmware_runtime.recording.values import Reader, pack, unpack
from tests.blackbox.test_keyframes import VALUES
from tests.blackbox.test_refused_states import HOSTILE
from tests.support.nodes import Node

OURS = (values, value_reader, value_writer, records, differences)
"""Modules whose functions are gone into."""
MADE = {
    *("bool", "bytearray", "complex", "dict", "frozenset", "int", "list", "object", "set", "str"),
    *("bytes", "tuple", "type", "array.array", "collections.OrderedDict", "collections.deque"),
    "random.Random",
}
"""Classes that may be called, or of which it is asked whether something is of them."""
ASKED = {
    *("abc.ABCMeta", "enum.Enum", "enum.EnumType", "enum.Flag", "functools.cached_property"),
    *("msgspec.Struct", "types.ModuleType", "types.MemberDescriptorType", "NoneType", "float"),
    *("types.GetSetDescriptorType", "operator.attrgetter", "StructMeta"),
}
"""Those of which it is only asked, and the getter of fields."""
CALLED = {
    *("all", "any", "enumerate", "getattr", "hasattr", "isinstance", "issubclass", "iter", "len"),
    *(
        "encode",
        "hex",
        "decode",
        "id",
        "map",
        "min",
        "next",
        "sorted",
        "vars",
        "zip",
        "firmware_runtime.errors.text_of",
    ),
}
"""Functions of Python, and ours that words an error."""
ERRORS = {
    "UnicodeEncodeError",
    "UnknownValue",
    "ConfigError",
    "Exception",
    "AttributeError",
    "TypeError",
    "ValueError",
}


def code_of(function: Callable[..., Any]) -> Iterator[types.CodeType]:
    """The code of a function and of those within it."""
    waiting = [function.__code__]
    while waiting:
        code = waiting.pop()
        yield code
        waiting += [each for each in code.co_consts if isinstance(each, types.CodeType)]


def functions_in(thing: object) -> Iterator[Callable[..., Any]]:
    """A function; the methods of a class of ours; the functions that a table of ours holds."""
    if isinstance(thing, types.FunctionType):
        yield thing
    elif isinstance(thing, type):
        yield from (each for each in vars(thing).values() if isinstance(each, types.FunctionType))
    elif isinstance(thing, dict):
        yield from (each for each in thing.values() if isinstance(each, types.FunctionType))


def reached(*begins: object) -> set[object]:
    """All that the code of these names, and the code of what it names in our modules."""
    names = {each.__name__ for each in OURS}
    found: dict[int, object] = {}
    seen: set[int] = set()
    waiting = [function for each in begins for function in functions_in(each)]
    while waiting:
        function = waiting.pop()
        if id(function) in seen:
            continue
        seen.add(id(function))
        for name in (name for code in code_of(function) for name in code.co_names):
            thing = function.__globals__.get(name, vars(builtins).get(name))
            if thing in (None, Any) or isinstance(thing, str | int | types.ModuleType):
                continue
            is_ours = getattr(thing, "__module__", None) in names or isinstance(thing, dict)
            waiting += functions_in(thing) if is_ours else ()
            found.update({} if is_ours else {id(thing): thing})
    return set(found.values())


def test_what_reading_can_reach_is_a_closed_list() -> None:
    for thing in reached(Reader, differences.in_plain, differences.between):
        if not isinstance(thing, type | types.FunctionType | types.BuiltinFunctionType):
            continue
        module = thing.__module__ or ""
        name = thing.__qualname__ if module == "builtins" else f"{module}.{thing.__qualname__}"
        known = MADE | ASKED | CALLED | ERRORS
        assert name in known or name.rpartition(".")[2] in known, name


def test_no_module_is_imported_or_named_through_another() -> None:
    for module in OURS:
        for each in vars(module).values():
            if getattr(each, "__module__", None) != module.__name__:
                continue
            for function in functions_in(each):
                words = {name for code in code_of(function) for name in code.co_names}
                assert words.isdisjoint({"__import__", "import_module", "eval", "exec", "open"})


OURS_TO_CALL = (str(Path(values.__file__).parent), str(Path(rows.__file__).parent))
OF_PYTHON = {"enum.py", "random.py", "dataclasses.py", "functools.py", "errors.py", "threading.py"}
"""Files of functions that read what a class is, seed a generator, or word an error."""


def restored(form: object) -> set[str]:
    """The files of the functions that restoring a field of that form has called."""
    files: set[str] = set()

    def note(frame: types.FrameType, event: str, _: object) -> None:
        if event == "call":
            files.add(frame.f_code.co_filename)

    table = StateTable({"node": Node(value=None)})
    fingerprint, built, _, aside = unpack(table.capture())
    content = pack([fingerprint, built, {0: {"value": form}}, aside])
    before = sys.getprofile()
    gc.disable()  # what is collected meanwhile is none of it
    sys.setprofile(note)
    try:
        table.restore(content)
    except ForeignState:
        pass
    finally:
        sys.setprofile(before)
        gc.enable()
    return files


FORMS = [*HOSTILE.values(), *(values.plain(each) for each in VALUES.values())]


@pytest.mark.parametrize("form", FORMS)
def test_no_function_of_a_model_is_called(form: object) -> None:
    others = {Path(each) for each in restored(form) if not each.startswith(OURS_TO_CALL)}
    strange = {each for each in others if each.name not in OF_PYTHON and "numpy" not in each.parts}
    assert all(each.name.startswith("<") for each in strange), strange
