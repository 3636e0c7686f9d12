"""Verbs that other packages add: carried out like ours, and named where they are broken."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from tests.support.installed_here import installed_here

ENTRIES = "[firmware_runtime.commands]\nwave = heron.wave\n"
SOUND = """
def add_to(verbs):
    parser = verbs.add_parser("wave")
    parser.set_defaults(execute=lambda parsed: print("waved") or 0)
"""
BROKEN = {
    "an import that fails": ("import no_such_module", ENTRIES),
    "no add_to": ("", ENTRIES),
    "an object that is no module": ("wave = 3", ENTRIES.replace("heron.wave", "heron.wave:wave")),
    "no such module": (SOUND, ENTRIES.replace("heron.wave", "heron.dive")),
    "an add_to that raises": ("def add_to(verbs):\n    return 1 / 0", ENTRIES),
    "an entry point that names no module": (SOUND, ENTRIES.replace("heron.wave", "not a module!")),
}
broken = pytest.mark.parametrize(("module", "entries"), BROKEN.values(), ids=BROKEN)


def test_a_verb_of_another_package_is_carried_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with installed_here(tmp_path, "heron", {"wave.py": SOUND}, ENTRIES):
        assert main(["wave"]) == 0
    assert "waved" in capsys.readouterr().out


@broken
def test_a_broken_verb_is_one_sentence_with_its_packages_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], module: str, entries: str
) -> None:
    with installed_here(tmp_path, "heron", {"wave.py": module}, entries):
        assert main(["wave"]) == 2
    assert "command wave of the package heron" in capsys.readouterr().err


def waving(execute: str) -> str:
    return SOUND.replace('lambda parsed: print("waved") or 0', execute)


@pytest.mark.parametrize(
    ("module", "named"),
    [
        (waving("lambda parsed: 1 / 0"), "execute: ZeroDivisionError"),
        (waving("lambda parsed: open('/no/such/file')"), "execute: FileNotFoundError"),
        (waving("lambda parsed: 'waved'"), "execute returned 'waved'"),
        (waving("lambda: 0"), "execute: TypeError"),
        (SOUND.rpartition("\n    parser.set")[0], "execute: AttributeError"),
    ],
)
def test_a_verb_that_breaks_while_it_is_carried_out_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], module: str, named: str
) -> None:
    with installed_here(tmp_path, "heron", {"wave.py": module}, ENTRIES):
        assert main(["wave"]) == 2
    said = capsys.readouterr().err
    assert "command wave of the package heron" in said
    assert named in said


def test_a_verb_may_return_nothing_or_end_the_program(tmp_path: Path) -> None:
    with installed_here(tmp_path, "heron", {"wave.py": waving("print")}, ENTRIES):
        assert main(["wave"]) == 0
    leaving = "import sys\n" + waving("lambda parsed: sys.exit(7)")
    with (
        installed_here(tmp_path / "other", "heron", {"wave.py": leaving}, ENTRIES),
        pytest.raises(SystemExit) as ended,
    ):
        main(["wave"])
    assert ended.value.code == 7


@pytest.mark.slow
@broken
def test_a_broken_verb_does_not_keep_the_others_from_being_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], module: str, entries: str
) -> None:
    with (
        installed_here(tmp_path, "heron", {"wave.py": module}, entries),
        pytest.raises(SystemExit) as ended,
    ):
        main(["--help"])
    assert ended.value.code == 0
    assert "safe-state" in capsys.readouterr().out


def test_a_verb_may_name_its_group_and_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = 'HELP_GROUP = "machine"\nHELP_LINE = "Wave a flag."\n'
    for module, group, line in (
        (shown + SOUND, "machine", "  wave        Wave a flag."),
        (SOUND.replace('"wave"', '"wave", description="Wave."'), "others", "  wave        Wave."),
    ):
        with (
            installed_here(tmp_path / group, "heron", {"wave.py": module}, ENTRIES),
            pytest.raises(SystemExit),
        ):
            main(["--help"])
        found = [part for part in capsys.readouterr().out.split("\n\n") if line in part]
        assert [part.partition(":")[0] for part in found] == [group]
