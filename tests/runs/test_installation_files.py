"""Installing into a directory: which files, with what in them, once and again."""

import os
import stat
from pathlib import Path

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError, StepFailed
from firmware_runtime.host.installation.plan import settings_path
from firmware_runtime.host.installation.target import Target, Tree
from firmware_runtime.host.installation.uninstall import Removal, installed_boards
from tests.support.installation_rig import files_below, install

UNITS = "etc/systemd/system"
SHARED = {
    f"{UNITS}/firmware-runtime@.service",
    f"{UNITS}/firmware-runtime-guard@.service",
    f"{UNITS}/firmware-runtime-metrics@.service",
    f"{UNITS}/firmware-runtime-record@.service",
    f"{UNITS}/firmware-runtime-bridge@.service",
    f"{UNITS}/firmware-runtime-ros2@.service",
    "etc/sysusers.d/firmware-runtime.conf",
    "etc/tmpfiles.d/firmware-runtime.conf",
    "etc/udev/rules.d/60-firmware-runtime.rules",
}


def of_board(board: str) -> set[str]:
    return {
        f"etc/firmware-runtime/{board}.toml",
        f"{UNITS}/firmware-runtime@{board}.service.d/board.conf",
        f"{UNITS}/firmware-runtime-guard@{board}.service.d/board.conf",
        f"{UNITS}/firmware-runtime-ros2@{board}.service.d/board.conf",
        f"{UNITS}/multi-user.target.wants/firmware-runtime@{board}.service",
        f"{UNITS}/multi-user.target.wants/firmware-runtime-guard@{board}.service",
    }


def uninstall(board: str, root: Path, *, purge: bool = False) -> list[str]:
    reported: list[str] = []
    Removal(board, Target(Tree(root)), purge=purge).carry_out(reported.append)
    return reported


@pytest.mark.parametrize("board", kinds.names())
def test_every_file_of_a_board_is_written_and_linked_as_systemctl_does(
    tmp_path: Path, board: str
) -> None:
    reported = install(board, tmp_path)
    assert files_below(tmp_path).keys() == SHARED | of_board(board)
    assert len(reported) == len(SHARED) + 6
    assert all(line.startswith(("written: ", "linked: ")) for line in reported)
    link = tmp_path / UNITS / "multi-user.target.wants" / f"firmware-runtime@{board}.service"
    assert str(link.readlink()) == "/etc/systemd/system/firmware-runtime@.service"


def test_files_can_be_read_by_all_and_written_by_their_owner(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        install("tachobot", tmp_path / "root")
    finally:
        os.umask(before)
    for path in (tmp_path / "root").rglob("*"):
        mode = stat.S_IMODE(path.stat(follow_symlinks=False).st_mode)
        if not path.is_symlink():
            assert mode == (0o755 if path.is_dir() else 0o644), path


def test_units_start_the_program_that_is_named(tmp_path: Path) -> None:
    install("tachobot", tmp_path, "/opt/a%b/firmware-runtime")
    unit = (tmp_path / UNITS / "firmware-runtime@.service").read_text()
    assert "\nExecStart=/opt/a%%b/firmware-runtime run /etc/firmware-runtime/%i.toml\n" in unit
    assert "/opt/firmware-runtime" not in unit


def test_a_second_time_nothing_changes(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    before = files_below(tmp_path)
    reported = install("tachobot", tmp_path)
    assert {line.partition(":")[0] for line in reported} == {"unchanged"}
    assert files_below(tmp_path) == before


def test_what_was_changed_is_restored(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    unit = tmp_path / UNITS / "firmware-runtime@.service"
    rules = tmp_path / "etc/udev/rules.d/60-firmware-runtime.rules"
    whole = unit.read_bytes()
    unit.write_text("[Service]\n")
    rules.chmod(0o600)
    reported = install("tachobot", tmp_path)
    written = [line for line in reported if not line.startswith("unchanged: ")]
    assert written == [f"written: {unit}", f"written: {rules}"]
    assert unit.read_bytes() == whole
    assert stat.S_IMODE(rules.stat().st_mode) == 0o644


def test_the_users_settings_are_kept_and_the_difference_shown(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    copy = tmp_path / "etc/firmware-runtime/tachobot.toml"
    users = copy.read_text().replace("kp = 0.75", "kp = 0.5")
    copy.write_text(users)
    reported = install("tachobot", tmp_path)
    assert copy.read_text() == users
    assert reported[0] == f"kept: yours differs: {copy}"
    assert "    -kp = 0.75\n    +kp = 0.5\n" in reported[1]


def test_drop_ins_follow_the_users_settings(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    copy = tmp_path / "etc/firmware-runtime/tachobot.toml"
    text = copy.read_text().replace("/dev/i2c-1", "/dev/i2c-7")
    copy.write_text(text.replace("fifo_priority = 60", "fifo_priority = 41"))
    install("tachobot", tmp_path)
    drop_in = tmp_path / UNITS / "firmware-runtime@tachobot.service.d/board.conf"
    assert "DeviceAllow=/dev/i2c-7 rw" in drop_in.read_text()
    assert "LimitRTPRIO=41" in drop_in.read_text()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (b'board = "tachobot"\nwings = 2\n', "wings: unknown key"),
        (registry.load("detective").source.read_bytes(), "'detective': expected 'tachobot'"),
    ],
    ids=["broken", "of another board"],
)
def test_settings_of_no_use_are_refused_before_anything_is_written(
    tmp_path: Path, text: bytes, fault: str
) -> None:
    copy = tmp_path / "etc/firmware-runtime/tachobot.toml"
    copy.parent.mkdir(parents=True)
    copy.write_bytes(text)
    with pytest.raises(ConfigError, match=fault) as raised:
        install("tachobot", tmp_path)
    assert len(raised.value.faults) > 1 or "expected" in fault
    assert list(files_below(tmp_path)) == ["etc/firmware-runtime/tachobot.toml"]


def test_a_place_that_cannot_be_written_or_listed_is_named(tmp_path: Path) -> None:
    (tmp_path / "etc").write_text("")
    with pytest.raises(StepFailed, match=r"tachobot\.toml: cannot be read \(Not a directory\)"):
        install("tachobot", tmp_path)
    with pytest.raises(StepFailed, match=r"etc/systemd: cannot be read \(Not a directory\)"):
        Tree(tmp_path).names("/etc/systemd")


def test_nothing_half_written_is_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StepFailed, match="cannot be written"):
        install("tachobot", tmp_path)
    assert files_below(tmp_path) == {}


def test_the_last_board_takes_everything_with_it_and_removing_twice_is_no_fault(
    tmp_path: Path,
) -> None:
    install("tachobot", tmp_path)
    reported = uninstall("tachobot", tmp_path, purge=True)
    assert files_below(tmp_path) == {}
    assert len(reported) == len(SHARED) + 6
    assert [path for path in tmp_path.rglob("*") if "firmware-runtime" in path.name] == []
    assert uninstall("tachobot", tmp_path, purge=True) == []


def test_another_board_keeps_what_both_share(tmp_path: Path) -> None:
    for board in ("tachobot", "detective"):
        install(board, tmp_path)
    assert installed_boards(Target(Tree(tmp_path))) == ["detective", "tachobot"]
    uninstall("tachobot", tmp_path, purge=True)
    assert files_below(tmp_path).keys() == SHARED | of_board("detective")


def test_without_purge_the_users_settings_stay(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    statistics = tmp_path / "run/firmware-runtime/tachobot.stats"
    statistics.parent.mkdir(parents=True)
    statistics.write_text("")
    removal = Removal("tachobot", Target(Tree(tmp_path)), purge=False)
    removal.carry_out(lambda _: None)
    kept = (settings_path("tachobot"), "/run/firmware-runtime")
    assert removal.what_stays() == [f"{tmp_path}{path}" for path in kept]
    assert list(files_below(tmp_path)) == [
        "etc/firmware-runtime/tachobot.toml",
        "run/firmware-runtime/tachobot.stats",
    ]


def test_purge_takes_what_runs_left_of_this_board_only(tmp_path: Path) -> None:
    for board in ("tachobot", "detective"):
        install(board, tmp_path)
    left = tmp_path / "run/firmware-runtime"
    left.mkdir(parents=True)
    for board in ("tachobot", "detective"):
        (tmp_path / "var/lib/firmware-runtime" / board / "run").mkdir(parents=True)
    for name in (
        "tachobot.stats",
        "tachobot.guard",
        ".tachobot.guard.unfinished",
        "detective.stats",
    ):
        (left / name).write_text("")
    uninstall("tachobot", tmp_path, purge=True)
    assert [path.name for path in left.iterdir()] == ["detective.stats"]
    records = tmp_path / "var/lib/firmware-runtime"
    assert [path.name for path in records.iterdir()] == ["detective"]
    uninstall("detective", tmp_path, purge=True)
    assert not left.exists()
    assert not records.exists()


def test_files_of_others_stay(tmp_path: Path) -> None:
    install("tachobot", tmp_path)
    own = tmp_path / UNITS / "firmware-runtime@tachobot.service.d/override.conf"
    own.write_text("[Service]\n")
    uninstall("tachobot", tmp_path, purge=True)
    assert list(files_below(tmp_path)) == [str(own.relative_to(tmp_path))]
