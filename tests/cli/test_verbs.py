"""Verbs: their help, what they load, and those of other packages."""

import gc
from importlib.metadata import version
from pathlib import Path

import pytest

from firmware_runtime.cli import main as module
from firmware_runtime.cli.commands import bench
from firmware_runtime.cli.main import main
from firmware_runtime.cli.verbs import GROUPS, VERBS
from firmware_runtime.links.key_file import read_key
from tests.support.command import Command, in_python, own_process
from tests.support.installed_here import installed_here


def test_show_lists_each_board_with_its_description(command: Command) -> None:
    ended = command("show")
    assert ended.status == 0
    assert "tachobot     hovering platform" in ended.out


def test_check_adds_up_the_bus_and_what_its_adapter_takes(command: Command) -> None:
    ended = command("check", "tachobot")
    assert ended.status == 0
    assert "i2c1: 13.6% of its time at 400000 Hz" in ended.out
    assert "imu sample every 10 ms" in ended.out
    ended = command("check", "tachobot", "--set", "buses.i2c1.overhead_us=100")
    assert "i2c1: 15.6% of its time at 400000 Hz and 100 us a transaction" in ended.out


def test_show_has_the_hierarchy_without_touching_a_bus(command: Command) -> None:
    ended = command("show", "tachobot")
    assert ended.status == 0
    for name in ("tachobot", "controller", "attitude", "yaw", "thrust_pairs", "imu"):
        assert name in ended.out


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_every_command_has_help(command: Command, verb: str) -> None:
    ended = command(*verb.split(), "--help")
    assert ended.status == 0
    assert "usage: firmware-runtime" in ended.out
    assert ("\nrun again:\n" in ended.out) == (verb == "")


def test_help_has_each_verb_in_its_group_in_a_line(command: Command) -> None:
    groups = command("--help").out.split("\n\n")
    for group, verbs in GROUPS.items():
        (shown,) = [each.splitlines()[1:] for each in groups if each.startswith(f"{group}:\n")]
        assert [line.split()[0] for line in shown][: len(verbs)] == [*verbs]
        assert all(len(line) <= 60 for line in shown)
    assert "  probe " in command("--help").out


def test_without_a_command_it_is_said_where_they_are(command: Command) -> None:
    assert "--help" in command.refused()


def test_of_a_wrong_word_the_nearest_comes_first_and_the_list_last(
    command: Command,
) -> None:
    error = command.refused("stat", "tachobot")
    assert error.startswith("firmware-runtime: stat: no such command; did you mean stats? ")
    assert error.endswith(", doubles, probe, try\n")


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version_is_printed_without_loading_a_verb(
    command: Command, option: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_modules", None)
    ended = command(option)
    assert (ended.status, ended.out) == (0, f"firmware-runtime {version('firmware-runtime')}\n")


@pytest.mark.slow
def test_the_package_is_the_command_too() -> None:
    ended = own_process("arm", "tachobot", "--statistics", "none")
    assert ended.returncode == 3
    assert "none.socket: No such file or directory; expected a run" in ended.stderr


SHOWS = """
import atexit, gc, sys
from firmware_runtime.cli import main as module
executed = module._executed
def shown(parsed):
    print("enabled", gc.isenabled(), "kept", gc.get_freeze_count() > 1000)
    return executed(parsed)
module._executed = shown
atexit.register(lambda: print("ends", gc.isenabled()))
sys.argv[1:] = ["show"]
sys.exit(module.main())
"""
LOADS = """
import gc, sys
from firmware_runtime.cli.commands import run
from firmware_runtime.cli.main import main
frozen, enabled = [], []
def seen(function):
    def load(*words):
        frozen.append(gc.get_freeze_count())
        enabled.append(gc.isenabled())
        return function(*words)
    return load
run.chosen_board, run._session = seen(run.chosen_board), seen(run._session)
sys.argv[1:] = "run tachobot --doubles --clock virtual --for 1.5".split()
main()
print("more frozen", frozen[1] - frozen[0] > 1000, "enabled", enabled)
"""


@pytest.mark.slow
def test_nor_is_what_a_run_goes_on_to_load() -> None:
    done = in_python(LOADS, check=True)
    assert done.stdout.splitlines()[-1] == "more frozen True enabled [False, False]"


@pytest.mark.slow
def test_what_a_start_makes_is_never_looked_through() -> None:
    done = in_python(SHOWS, check=True)
    lines = done.stdout.splitlines()
    assert lines[0] == "enabled True kept True"
    assert lines[-1] == "ends True"


def test_a_command_within_a_program_leaves_its_collection_alone(
    command: Command,
) -> None:
    before = gc.get_freeze_count()
    assert "tachobot" in command.said("show")
    assert gc.isenabled()
    assert gc.get_freeze_count() == before


NOT_NEEDED = ("numpy", "rclpy", "asyncio", "firmware_drivers.catalogue", "sim_doubles")
NOT_NEEDED_OF_OURS = (
    "devs.engine",
    "executive",
    "host.doctor",
    "links.bridge",
    "recording",
    "runs.guard",
    "runs.session",
    "runs.start",
    "statistics.trace_file",
    "view",
)


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_nothing_is_imported_that_only_a_run_needs(board: str) -> None:
    program = (
        "import sys\n"
        "from firmware_runtime.cli.main import parser\n"
        "from firmware_runtime.cli.chosen_board import chosen_board\n"
        f"words = ['safe-state', '{board}', '--doubles', '/nowhere']\n"
        "parsed = parser(words).parse_args(words)\n"
        "chosen_board(parsed.board, parsed.assignments)\n"
        "print('\\n'.join(sys.modules))"
    )
    done = in_python(program, check=True)
    loaded = set(done.stdout.split())
    not_needed = {*NOT_NEEDED, *(f"firmware_runtime.{each}" for each in NOT_NEEDED_OF_OURS)}
    assert "firmware_runtime.runs.safe_state" in loaded
    assert loaded & not_needed == set()


AT_THE_FIRST_STEP = """
import os, sys
from firmware_runtime.cli.main import main
from firmware_runtime.executive.loop import Loop
def show(*_):
    print("loaded:", *sys.modules, flush=True)
    os._exit(0)
Loop._work_off = show
sys.argv[1:] = ["run", "tachobot", "--doubles"]
main()
"""
OURS = {"firmware_runtime", "firmware_drivers", "firmware_boards", "sim_doubles"}
MOST_MODULES = 221
NOT_FOR_A_RUN = {"dataclasses", "importlib.resources", "matplotlib", "firmware_runtime.view.parts"}
"""Of Python itself: each takes milliseconds of a start."""


@pytest.mark.slow
def test_a_plain_run_has_loaded_what_it_needs_by_its_first_step() -> None:
    loaded = in_python(AT_THE_FIRST_STEP, check=True).stdout.partition("loaded:")[2].split()
    ours = [each for each in loaded if each.partition(".")[0] in OURS]
    assert len(ours) <= MOST_MODULES
    assert not NOT_FOR_A_RUN.intersection(loaded)


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
    for text, group, line in (
        (shown + SOUND, "machine", "  wave        Wave a flag."),
        (SOUND.replace('"wave"', '"wave", description="Wave."'), "others", "  wave        Wave."),
    ):
        with (
            installed_here(tmp_path / group, "heron", {"wave.py": text}, ENTRIES),
            pytest.raises(SystemExit),
        ):
            main(["--help"])
        found = [part for part in capsys.readouterr().out.split("\n\n") if line in part]
        assert [part.partition(":")[0] for part in found] == [group]


def test_a_key_is_made_once_and_never_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "robot.key"
    assert main(["new", "key", str(path)]) == 0
    printed = capsys.readouterr().out
    key = read_key(path)
    assert str(path) in printed
    assert key.hex() not in printed
    assert main(["new", "key", str(path)]) == 2
    assert read_key(path) == key
    assert "overwritten" in capsys.readouterr().err


CHECKOUT = Path(__file__).parents[2]


def test_where_there_is_no_checkout_it_says_so_in_a_sentence(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "checkout", lambda: None)
    assert len(command.refused("bench", "devstone").splitlines()) == 1


def test_every_folder_of_a_bench_has_a_name_and_says_what_it_is() -> None:
    files = {each.parent.name: each for each in (CHECKOUT / "benchmarks").glob("*/bench.py")}
    assert files.keys() == set(bench._BENCHES)
    for file in files.values():  # to import them would take their peers
        for name in ("SUMMARY = ", "def add_options(", "def execute("):
            assert f"\n{name}" in file.read_text(encoding="utf-8"), file
