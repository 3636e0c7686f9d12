"""Links, paths and commands of every page lead somewhere."""

import argparse
import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.cli.main import parser

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#\s]*)(?:#([^)\s]+))?\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def pages() -> list[Path]:
    listed = subprocess.run(
        ("git", "ls-files", "*.md"), cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [ROOT / line for line in listed.stdout.splitlines()]


def anchors_of(page: Path) -> set[str]:
    """The headings, as GitHub makes anchors of them."""
    headings = HEADING.findall(page.read_text(encoding="utf-8"))
    return {
        re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings
    }


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    broken = []
    for path, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            broken.append(f"{path}#{anchor}")
    assert broken == []


def test_the_index_leads_to_every_page() -> None:
    docs = ROOT / "docs"
    linked = {path for path, _ in LINK.findall((docs / "index.md").read_text(encoding="utf-8"))}
    assert {page.name for page in docs.glob("*.md")} - {"index.md"} <= linked


TOPS = "firmware_runtime|drivers|boards|sim_doubles|benchmarks|docs|tests|systemd|examples"
PATH = re.compile(rf"(?<![\w/.-])((?:{TOPS})(?:/[\w.-]+)+)")
MODULE = re.compile(r"python -m ((?:firmware_runtime|benchmarks|tests)(?:\.\w+)+)")
PATTERNS = ("*.md", "*.yml", "*.yaml", "*.sh", "*.service", "Makefile", "pyproject.toml")
OF_A_USER = re.compile(r"/(?:test_)?(?:x|light|rover|chipname)\.py$")
"""Files that a page asks its reader to write."""


def tracked(*patterns: str) -> list[str]:
    listed = subprocess.run(
        ("git", "ls-files", *patterns), cwd=ROOT, capture_output=True, text=True, check=True
    )
    return listed.stdout.splitlines()


def texts() -> dict[str, str]:
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in tracked(*PATTERNS)}


def exists(path: str, name: str) -> bool:
    """Seen from the root, or from the folder of the file that names it."""
    return (ROOT / path).exists() or (ROOT / name).parent.joinpath(path).exists()


def test_paths_that_are_named_exist() -> None:
    missing = [
        f"{name}: {path}"
        for name, text in texts().items()
        for path in (found.rstrip("./-") for found in PATH.findall(text))
        if not exists(path, name) and not OF_A_USER.search(path)
    ]
    assert missing == []


def test_modules_that_are_run_by_name_exist() -> None:
    missing = [
        f"{name}: {module}"
        for name, text in texts().items()
        for module in MODULE.findall(text)
        for place in (ROOT / module.replace(".", "/"),)
        if not (place.is_dir() or place.with_suffix(".py").exists())
    ]
    assert missing == []


TEMPLATES = "firmware_runtime/host/scaffold/chip_template"
BLOCK = re.compile(r"^```.*?^```$|^ {4}.*?$", re.DOTALL | re.MULTILINE)
LINE = re.compile(r"^ *(?:\$ )?(?:sudo |nice )?(?:\S*/)?firmware-runtime (.+)$", re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
NOTATION = re.compile(r"\[|\||\.\.\.|(?<![\w.=])[A-Z]+\b")
"""In a command that is spelled out nothing is left to choose or to fill in."""
SHELL = {"|", "&", "&&", "||", ";", "<", ">", ">>", "2>", "2>&1"}
CHIP_OF_A_USER = re.compile(r"^try light\b")
"""One that its page has the reader write."""
TARGET = re.compile(r"(?:`|^ {4})make ([a-z][\w-]*)", re.MULTILINE)


def named_pages() -> list[Path]:
    """The changelog is left out: it names what has gone."""
    listed = subprocess.run(
        ("git", "ls-files", "*.md"), cwd=ROOT, capture_output=True, text=True, check=True
    )
    names = [name for name in listed.stdout.splitlines() if not name.startswith(TEMPLATES)]
    return [ROOT / name for name in names]


of_every_page = pytest.mark.parametrize(
    "page", named_pages(), ids=lambda page: str(page.relative_to(ROOT))
)


def lines(text: str) -> list[str]:
    """The commands in blocks of code, without the program's name."""
    blocks = "\n".join(BLOCK.findall(text.replace("\\\n", " ")))
    return LINE.findall(blocks)


def spans(text: str) -> list[str]:
    """What stands as code within sentences; a table has its bars behind a backslash."""
    found = SPAN.findall(BLOCK.sub("", text))
    return [" ".join(span.split()).replace("\\|", "|") for span in found]


def spelled_out(text: str) -> Iterator[list[str]]:
    """The words of each command that has nothing left to fill in; a verb alone is mentioned."""
    called = [span.removeprefix("firmware-runtime ") for span in spans(text)]
    inline = [
        call for call, span in zip(called, spans(text), strict=True) if call != span and " " in call
    ]
    for command in [*lines(text), *inline]:
        if not NOTATION.search(command.partition("#")[0]):
            words = shlex.split(CHIP_OF_A_USER.sub("try mpu9250", command), comments=True)
            ends = [place for place, word in enumerate(words) if word in SHELL]
            if "--help" not in words:  # which ends the program
                yield words[: min(ends, default=None)]


def subparsers(of: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of its verbs."""
    return {
        name: verb
        for action in of._actions
        if isinstance(action, argparse._SubParsersAction)
        for name, verb in action.choices.items()
    }


VERBS = subparsers(parser([]))


def options_in(of: argparse.ArgumentParser) -> frozenset[str]:
    """Those of a verb and of its own verbs."""
    own = frozenset(of._option_string_actions)
    return own.union(*map(options_in, subparsers(of).values()))


def options_of_bench(name: str) -> set[str]:
    """As its files spell them; to import it would take its peers."""
    files = (ROOT / "benchmarks" / name).glob("*.py")
    return {
        option
        for file in files
        for option in re.findall(r'"(--[a-z][\w-]*)"', file.read_text(encoding="utf-8"))
    }


def unknown_options(command: str) -> list[str]:
    verb, *rest = command.split()
    if verb not in VERBS:
        return []
    is_of_a_bench = verb == "bench" and rest and rest[0].islower()
    known = options_of_bench(rest[0]) if is_of_a_bench else options_in(VERBS[verb])
    return [option for option in OPTION.findall(command.partition("#")[0]) if option not in known]


def test_commands_are_found_in_blocks_sentences_and_tables() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert ["replay", "tachobot"] in spelled_out(text)
    page = (ROOT / "docs" / "first-model.md").read_text(encoding="utf-8")
    assert ["top", "./room.stats"] in spelled_out(page)
    table = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert "... run BOARD --doubles" in spans(table)
    assert unknown_options("run BOARD --double") == ["--double"]


def test_every_verb_has_its_line_in_the_page_of_commands() -> None:
    table = spans((ROOT / "docs" / "commands.md").read_text(encoding="utf-8"))
    assert VERBS.keys() <= {word.strip(",") for span in table for word in span.split()}


@of_every_page
def test_a_command_that_is_spelled_out_is_taken(page: Path) -> None:
    for words in spelled_out(page.read_text(encoding="utf-8")):
        assert callable(parser(words).parse_args(words).execute), words


@of_every_page
def test_a_verb_has_the_options_that_are_named_with_it(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    commands = [*lines(text), *(span.removeprefix("firmware-runtime ") for span in spans(text))]
    unknown = [(each, options) for each in commands if each and (options := unknown_options(each))]
    assert unknown == []


@of_every_page
def test_the_targets_of_make_that_are_named_exist(page: Path) -> None:
    makefiles = [ROOT / "Makefile", ROOT / TEMPLATES / "Makefile"]
    rules = "\n".join(makefile.read_text(encoding="utf-8") for makefile in makefiles)
    targets = set(re.findall(r"^([a-z][\w-]*):", rules, re.MULTILINE))
    assert set(TARGET.findall(page.read_text(encoding="utf-8"))) <= targets
