"""Wire formats and parsers under coverage-guided fuzzing: nothing but their own errors comes out.

Each target of `fuzz_targets` gets so many inputs, or as many as fit into its share of the time. An
input that raises something else, or takes too long or too much memory, is a finding; it is kept in
build/reliability. Needs atheris (`pip install --group fuzz`); without it nothing is tried.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from tests.reliability.fuzz_seeds import keep_corpus, seeds
from tests.reliability.fuzz_targets import TARGETS
from tests.reliability.results import (
    BUILD,
    ROOT,
    Result,
    commit,
    ends_at,
    in_order,
    read_kept,
    summed,
)

_LONGEST: Final = 4096
_OPTIONS: Final = ("-timeout=20", "-rss_limit_mb=2500", "-print_final_stats=1", "-verbosity=0")
_FINDING: Final = re.compile(r"^(?: === .*|\w*(?:Error|Exception|ERROR)\b.*)$", re.MULTILINE)


class Fuzzed(Struct, frozen=True):
    """How many inputs a target took, what was found, and the commits of the code, newest last."""

    name: str
    inputs: int
    finding: str = ""
    commit: str = ""

    def after(self, earlier: "Fuzzed") -> "Fuzzed":
        """Return it with the inputs of before; what was found then is to be found again."""
        commits = in_order(earlier.commit, self.commit)
        return replace(self, inputs=earlier.inputs + self.inputs, commit=commits)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this part."""
    parser.add_argument("--inputs", type=int, default=1_000_000, help="of each; default 10^6")
    parser.add_argument("--minutes", type=float, help="for all of them together")
    parser.add_argument("--targets", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument(
        "--add", action="store_true", help="to what is kept, inputs to those of before"
    )
    parser.add_argument("--keep-corpus", action="store_true", help="into tests/reliability/corpus")


def execute(arguments: argparse.Namespace) -> Result:
    """Fuzz one target after the other."""
    if find_spec("atheris") is None:
        said = "atheris is not installed; expected the dependency group fuzz; nothing was tried"
        return Result(name="fuzzing", summary=said, is_sound=True, figures={"targets": []})
    found: list[Fuzzed] = []
    share_s = 60 * (arguments.minutes or 0) / len(arguments.targets)
    until = ends_at(arguments.minutes)
    for name in arguments.targets:
        if time.monotonic() >= until:
            break  # each takes a while to begin, since all code is instrumented
        each = _fuzzed(name, arguments.inputs, int(share_s), keep=arguments.keep_corpus)
        sys.stdout.write(
            f"{each.name}: {each.inputs:,} inputs{f', {each.finding}' * bool(each.finding)}\n"
        )
        sys.stdout.flush()
        found.append(each)
    kept = read_kept("fuzzing") if arguments.add else None
    if kept is not None:
        earlier = msgspec.convert(kept.result.figures["targets"], list[Fuzzed])
        found = summed(earlier, found)
    inputs, wrong = sum(each.inputs for each in found), sum(bool(each.finding) for each in found)
    tried = f"{len(found)} of {len(TARGETS)} targets"
    return Result(
        name="fuzzing",
        summary=f"{tried}, {inputs:,} inputs, {wrong} findings",
        is_sound=not wrong,
        figures={"targets": found},
        is_read=kept is not None,
    )


def _fuzzed(name: str, inputs: int, limit_s: int, *, keep: bool) -> Fuzzed:
    with tempfile.TemporaryDirectory() as folder:
        corpus, given = Path(folder, "corpus"), Path(folder, "seeds")
        for each in (corpus, given, Path(folder, "made")):
            each.mkdir()
        for number, content in enumerate(seeds(name, Path(folder, "made"))):
            (given / str(number)).write_bytes(content)
        words = [f"-runs={inputs}", f"-max_total_time={limit_s}", f"-max_len={_LONGEST}", *_OPTIONS]
        words += [f"-artifact_prefix={folder}/finding-", str(corpus), str(given)]
        done = subprocess.run(
            [sys.executable, "-m", "tests.reliability.fuzz_one", name, *words],
            cwd=ROOT,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        if keep:
            keep_corpus(name, [each.read_bytes() for each in corpus.iterdir()])
        ran = re.search(r"stat::number_of_executed_units: *(\d+)", done.stderr)
        finding = "" if done.returncode == 0 else _kept(name, Path(folder), done)
        return Fuzzed(name, int(ran[1]) if ran else 0, finding, commit())


def _kept(name: str, folder: Path, done: "subprocess.CompletedProcess[str]") -> str:
    """Keep what was found and what was said; return a sentence."""
    to = BUILD / "findings" / name.replace("/", "_")
    to.mkdir(parents=True, exist_ok=True)
    for each in folder.glob("finding-*"):
        shutil.copy(each, to)
    (to / "said.txt").write_text(done.stdout[-20_000:] + done.stderr[-20_000:])
    said = _FINDING.findall(done.stdout + done.stderr)
    return (
        f"{said[-1].strip() if said else f'ended with {done.returncode}'} ({to.relative_to(ROOT)})"
    )
