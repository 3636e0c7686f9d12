"""Which tests run a line: measured once, by the quick tests, with a context for each test."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import msgspec
from coverage import CoverageData
from msgspec import Struct

QUICK: Final = "not slow and not real_time and not hardware"
_SOURCES: Final = ("firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles")


class CoverageMap(Struct, frozen=True):
    """Tests by line, the quickest first; and how long each takes, s."""

    tests: Mapping[str, Mapping[int, Sequence[str]]]
    """By file below the root, and line."""
    took_s: Mapping[str, float]

    def of(self, path: str, line: int, end: int) -> list[str]:
        """Return the tests that run any of these lines, the quickest first.

        A line that runs when its module is imported has no test of its own: it has those of all
        lines of its module.
        """
        lines = self.tests.get(path, {})
        found = {test for each in range(line, end + 1) for test in lines.get(each, ())}
        if not found:
            found = {test for tests in lines.values() for test in tests}
        return sorted(found, key=lambda test: (self.took_s.get(test, 0.0), test))


def measured(root: Path, folder: Path, tests: Sequence[str]) -> CoverageMap:
    """Run the quick tests of a checkout and return which lines they run; kept in a folder."""
    kept = folder / "coverage.json"
    if not kept.exists():
        folder.mkdir(parents=True, exist_ok=True)
        _run(root, folder, tests)
        kept.write_bytes(msgspec.json.encode(_read(root, folder)))
    return msgspec.json.decode(kept.read_bytes(), type=CoverageMap)


def _run(root: Path, folder: Path, tests: Sequence[str]) -> None:
    words = ["-n", "2", "-q", "-m", QUICK, "-p", "no:cacheprovider", "--tb=no"]
    words += [f"--basetemp={folder / 'tests'}", f"--junitxml={folder / 'tests.xml'}"]
    words += [f"--cov={each}" for each in _SOURCES]
    words += ["--cov-context=test", "--cov-report=", "-o", "junit_duration_report=call"]
    (folder / "coverage.toml").write_text(f'[tool.coverage.run]\ndata_file = "{folder / "data"}"\n')
    words += [f"--cov-config={folder / 'coverage.toml'}", *tests]
    done = subprocess.run([sys.executable, "-m", "pytest", *words], cwd=root, check=False)
    if done.returncode not in {0, 1}:
        raise SystemExit(f"the tests cannot be run: pytest ended with {done.returncode}")


def _read(root: Path, folder: Path) -> CoverageMap:
    took, failed = _results(folder / "tests.xml")
    data = CoverageData(str(folder / "data"))
    data.read()
    tests: dict[str, dict[int, list[str]]] = {}
    for name in data.measured_files():
        by_line: dict[int, set[str]] = defaultdict(set)
        for line, contexts in data.contexts_by_lineno(name).items():
            by_line[line] |= {_function(each) for each in contexts if each} - failed
        path = Path(name)
        if path.is_relative_to(root):
            found = {line: sorted(each) for line, each in by_line.items() if each}
            tests[str(path.relative_to(root))] = found
    return CoverageMap(tests, took)


def _function(context: str) -> str:
    """Return a test by its file and function; `file::function[values]|run` is its context."""
    return context.partition("|")[0].partition("[")[0]


def _results(path: Path) -> tuple[dict[str, float], set[str]]:
    """How long each function's tests took, and those that failed here without any mutant."""
    took: dict[str, float] = defaultdict(float)
    failed = set()
    for case in ET.parse(path).iter("testcase"):  # noqa: S314 -- of our own pytest
        file = case.get("classname", "").replace(".", "/") + ".py"
        name = f"{file}::{case.get('name', '').partition('[')[0]}"
        took[name] += float(case.get("time", 0.0))
        if case.find("failure") is not None or case.find("error") is not None:
            failed.add(name)
    return dict(took), failed
