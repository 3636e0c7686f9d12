"""Which test files call which functions of ours, as a plugin of pytest that writes it down.

    python -m pytest -p tests.reliability.called ...

Each process of the session leaves one file in FOLDER. A function is named by its file and its
qualified name, so the map outlives changes elsewhere.
"""

import ast
import os
import sys
import threading
from collections import defaultdict
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from time import process_time
from types import CodeType, FrameType
from typing import Final, TypeAlias

import msgspec
import pytest
from msgspec import Struct

from tests.reliability.results import BUILD, ROOT

FOLDER: Final = BUILD / "called"
_OURS: Final = tuple(
    f"{ROOT / each}{os.sep}" for each in ("firmware_runtime", "drivers", "sim_doubles")
)


class Calls(Struct):
    """What the tests of one file call, and the seconds of processor time that they take."""

    took_s: float = 0.0
    functions: set[str] = set()


class Listener:
    """Notes each function that is called while a test runs, in any thread of the process."""

    def __init__(self) -> None:
        self._seen: set[CodeType] = set()
        self._found: defaultdict[str, Calls] = defaultdict(Calls)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Listen to a test, its fixtures included."""
        self._seen.clear()
        began = process_time()
        threading.setprofile(self._see)
        sys.setprofile(self._see)
        try:
            return (yield)
        finally:
            sys.setprofile(None)
            threading.setprofile(None)
            calls = self._found[item.location[0]]
            calls.took_s += process_time() - began
            calls.functions |= {key for each in self._seen if (key := _key(each)) is not None}

    def pytest_sessionfinish(self) -> None:
        """Write what was found by this process."""
        FOLDER.mkdir(parents=True, exist_ok=True)
        (FOLDER / f"{os.getpid()}.json").write_bytes(msgspec.json.encode(self._found))

    def _see(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            self._seen.add(frame.f_code)


def pytest_configure(config: pytest.Config) -> None:
    """Listen, in each process that runs tests."""
    config.pluginmanager.register(Listener())


def read_calls() -> Mapping[str, Calls]:
    """Return what each test file calls; empty where nothing was written."""
    merged: defaultdict[str, Calls] = defaultdict(Calls)
    for path in FOLDER.glob("*.json"):
        for file, calls in msgspec.json.decode(path.read_bytes(), type=dict[str, Calls]).items():
            merged[file].took_s += calls.took_s
            merged[file].functions |= calls.functions
    return merged


def functions_by_line(path: str, tree: ast.AST) -> Mapping[int, str]:
    """Return the innermost function around each line that is in one, as it is named here."""
    return {
        line: f"{path}:{name}"
        for name, node in _functions(tree, "")
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }


_Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef


def _functions(node: ast.AST, within: str) -> Iterator[tuple[str, _Function]]:
    """Yield each function below a node with its qualified name, outer ones first."""
    for each in ast.iter_child_nodes(node):
        if isinstance(each, _Function):
            yield f"{within}{each.name}", each
            yield from _functions(each, f"{within}{each.name}.<locals>.")
        else:
            inside = f"{within}{each.name}." if isinstance(each, ast.ClassDef) else within
            yield from _functions(each, inside)


def _key(code: CodeType) -> str | None:
    """Return a function's name, None for what is not ours."""
    if not code.co_filename.startswith(_OURS):
        return None
    return f"{Path(code.co_filename).relative_to(ROOT).as_posix()}:{code.co_qualname}"
