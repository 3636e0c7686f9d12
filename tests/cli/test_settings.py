"""Settings in force on this machine, and two robots of one kind."""

import json
from pathlib import Path

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.local_settings import PLACE, known_names
from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from tests.support.command import Command
from tests.support.completion import ways_on

SHIPPED = {name: registry.load(name).source for name in kinds.names()}


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's copy of TachoBot's settings, as `service install` makes it."""
    copy = tmp_path / "etc" / "tachobot.toml"
    copy.parent.mkdir()
    copy.write_text(SHIPPED["tachobot"].read_text())
    monkeypatch.setenv(PLACE, str(copy.parent))
    return copy


def change(copy: Path, before: str, after: str) -> None:
    text = copy.read_text()
    assert before in text
    copy.write_text(text.replace(before, after))


@pytest.mark.slow
def test_check_by_name_reads_the_settings_in_force_and_says_so(
    command: Command, installed: Path
) -> None:
    ended = command("check", "tachobot")
    assert ended.status == 0
    assert f"{installed} is sound" in ended.out
    assert str(installed) in ended.error


@pytest.mark.slow
def test_a_fault_in_the_settings_in_force_is_found_by_name(
    command: Command, installed: Path
) -> None:
    change(installed, "speed_hz = 400_000", "speed_hz = 100")
    for verb in ("check", "show", "safe-state"):
        assert f"{installed}: 1 fault" in command.refused(verb, "tachobot")


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("show", "tachobot"),
        ("show", "tachobot", "-o", "couplings.svg"),
        ("doctor", "tachobot", "--json"),
        ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "0.1"),
        ("doubles", "serve", "tachobot", "--socket", "/no/folder/socket"),
        ("probe", "--doubles", "tachobot"),
    ],
    ids=lambda words: words[0],
)
def test_every_verb_by_name_says_where_its_settings_are_from(
    command: Command,
    installed: Path,
    words: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = command(*words)
    assert f"tachobot has its settings from {installed}" in ended.error


@pytest.mark.slow
def test_a_run_on_doubles_by_name_goes_by_the_settings_in_force(
    command: Command, installed: Path
) -> None:
    change(installed, "reference_rad = 1.0", "reference_rad = 0.25")
    ended = command("run", "tachobot", "--doubles", "--clock", "virtual", "--json")
    assert json.loads(ended.out)["result"]["yaw_rad"] == pytest.approx(0.25, abs=0.05)


@pytest.mark.slow
def test_assignments_hold_on_top_of_the_settings_in_force(
    command: Command, installed: Path
) -> None:
    change(installed, "reference_rad = 1.0", "reference_rad = 0.25")
    ended = command("check", "tachobot", "--set", "buses.i2c1.speed_hz=100000")
    assert ended.status == 0
    assert "warning: i2c1" in ended.out
    assert f"{installed} is sound" in ended.out


@pytest.mark.slow
def test_a_path_means_that_file_and_another_board_what_is_shipped(
    command: Command, installed: Path
) -> None:
    change(installed, "speed_hz = 400_000", "speed_hz = 100")
    by_path = command("check", SHIPPED["tachobot"])
    other = command("check", "detective")
    for ended, board in ((by_path, "tachobot"), (other, "detective")):
        assert (ended.status, ended.error) == (0, "")
        assert f"{SHIPPED[board]} is sound" in ended.out


@pytest.mark.slow
def test_settings_of_another_board_under_this_name_are_refused(
    command: Command, installed: Path
) -> None:
    installed.write_text(SHIPPED["detective"].read_text())
    assert "expected 'tachobot'" in command.refused("check", "tachobot")


@pytest.mark.slow
def test_boards_shows_which_settings_are_in_force(command: Command, installed: Path) -> None:
    assert f"in force on this machine: {installed}" in command("show").out


LEFT = 'name = "left"\n'


@pytest.fixture
def left(tmp_path: Path) -> Path:
    """A file for the left one of two TachoBots."""
    path = tmp_path / "left.toml"
    path.write_text(LEFT + kinds.shipped_file("tachobot").read_text())
    return path


@pytest.fixture
def installed_left(left: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Its settings are in force on this machine; returns their directory."""
    directory = tmp_path / "etc"
    directory.mkdir()
    left.rename(directory / left.name)
    monkeypatch.setenv(PLACE, str(directory))
    return directory


@pytest.mark.slow
def test_it_is_installed_under_its_name_and_once_more_by_its_name(
    left: Path, tmp_path: Path, command: Command
) -> None:
    root = tmp_path / "root"
    assert command("service", "install", left, "--root", root).status == 0
    units = root / "etc/systemd/system"
    assert (units / "firmware-runtime@left.service.d/board.conf").exists()
    assert (units / "multi-user.target.wants/firmware-runtime-guard@left.service").is_symlink()
    copy = root / "etc/firmware-runtime/left.toml"
    assert copy.read_text() == left.read_text()
    copy.write_text(f"{copy.read_text()}\n# mine\n")
    assert "unchanged: " + str(copy) in command.said("service", "install", "left", "--root", root)
    assert command("service", "uninstall", "left", "--root", root, "--purge").status == 0
    assert not list((root / "etc").rglob("*left*"))
    assert command("service", "uninstall", "left", "--root", root).status == 2


def test_what_is_in_force_is_read_by_its_name(installed_left: Path, command: Command) -> None:
    assert f"left: {installed_left / 'left.toml'} is sound" in command.said("check", "left")


@pytest.mark.slow
def test_boards_completion_and_a_wrong_name_know_it(installed_left: Path, command: Command) -> None:
    assert known_names() == [*kinds.names(), "left"]
    assert f"a tachobot, by {installed_left / 'left.toml'}" in command.said("show")
    for verb in (["run"], ["guard"], ["service", "logs"], ["service", "uninstall"]):
        assert ways_on(*verb, "le") == ["left"]
    assert "left" in command.refused("check", "lfet")


def test_a_copy_that_says_another_name_is_refused(installed_left: Path) -> None:
    path = installed_left / "left.toml"
    path.write_text(path.read_text().removeprefix(LEFT))
    with pytest.raises(ConfigError) as caught:
        registry.load_copy(path, "left")
    assert "name" in caught.value.faults[0]
    assert main(["check", "left"]) == 2


@pytest.mark.slow
@pytest.mark.usefixtures("installed_left")
def test_its_statistics_are_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    main(["run", "left", "--doubles", "--for", "0.2"])  # too short to be ready: it leaves figures
    assert (tmp_path / "left.stats").exists()
    assert not (tmp_path / "tachobot.stats").exists()
    assert main(["stats", "left"]) == 0
    assert main(["stats", "tachobot"]) == 2


@pytest.mark.parametrize("name", ["3", '"Left"', '"a/b"', '""', '"left.toml"'])
def test_a_name_that_no_unit_could_have_is_refused(left: Path, name: str) -> None:
    left.write_text(left.read_text().replace(LEFT, f"name = {name}\n"))
    with pytest.raises(ConfigError) as caught:
        registry.load(str(left))
    assert caught.value.faults[0].startswith("name: ")


@pytest.mark.usefixtures("installed_left")
def test_probe_compares_it_with_its_own_doubles(command: Command) -> None:
    assert "left fits" in command.said("probe", "--doubles", "left")
