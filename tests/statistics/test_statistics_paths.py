import os
from pathlib import Path

import pytest

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics import paths
from firmware_runtime.statistics.paths import default_path, find_statistics

VARIABLES = ("FIRMWARE_RUNTIME_STATE_DIRECTORY", "RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR")


@pytest.fixture(autouse=True)
def nothing_is_set(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for variable in VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(paths, "SYSTEM", tmp_path / "run")
    monkeypatch.setenv("TMPDIR", str(tmp_path))


def test_the_stated_directory_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in VARIABLES:
        monkeypatch.setenv(variable, f"/{variable}")
    expected = Path("/FIRMWARE_RUNTIME_STATE_DIRECTORY/tachobot.stats")
    assert default_path("tachobot") == expected


def test_then_the_first_directory_systemd_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/one:/run/two")
    assert default_path("tachobot") == Path("/run/one/tachobot.stats")


def test_then_the_system_directory_if_it_may_be_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1")
    assert default_path("tachobot") == Path("/run/user/1/firmware-runtime/tachobot.stats")
    (tmp_path / "run").mkdir()
    assert default_path("tachobot") == tmp_path / "run" / "tachobot.stats"


@pytest.mark.parametrize("was_open", [False, True])
def test_last_a_temporary_directory_closed_to_others(tmp_path: Path, *, was_open: bool) -> None:
    if was_open:
        (made := tmp_path / f"firmware-runtime-{os.geteuid()}").mkdir()
        made.chmod(0o777)
    path = default_path("tachobot")
    assert path == tmp_path / f"firmware-runtime-{os.geteuid()}" / "tachobot.stats"
    assert path.parent.stat().st_mode & 0o777 == 0o700


def test_a_temporary_directory_that_is_not_ours_is_refused(tmp_path: Path) -> None:
    (tmp_path / f"firmware-runtime-{os.geteuid()}").symlink_to("/root")
    with pytest.raises(StatisticsFileError, match="expected to own it"):
        default_path("tachobot")


def test_an_empty_variable_counts_as_not_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", "")
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/1")
    assert default_path("tachobot").parent == Path("/run/user/1/firmware-runtime")


def test_a_reader_finds_the_file_of_a_board_wherever_it_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    left = tmp_path / "user" / "firmware-runtime" / "tachobot.stats"
    left.parent.mkdir(parents=True)
    left.touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))
    assert find_statistics("tachobot") == left


def test_without_a_board_the_run_that_started_last_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    for started, board in ((2, "tachobot"), (1, "detective")):
        path = tmp_path / f"{board}.stats"
        path.touch()
        os.utime(path, ns=(started, started))
    assert find_statistics().name == "tachobot.stats"


def test_no_statistics_anywhere_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(StatisticsFileError, match=f"no statistics of detective in {tmp_path}"):
        find_statistics("detective")
    with pytest.raises(StatisticsFileError, match="no statistics of any board"):
        find_statistics()


@pytest.mark.parametrize("right", [os.R_OK, os.X_OK])
def test_a_directory_closed_to_this_user_is_passed_by_and_named_if_nothing_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, right: int
) -> None:
    closed = tmp_path / "run"
    closed.mkdir()
    real, denied = os.access, right | os.W_OK

    def access(path: Path, mode: int) -> bool:
        return not (path == closed and mode & denied) and real(path, mode)

    monkeypatch.setattr(os, "access", access)
    with pytest.raises(StatisticsFileError, match=r"run is closed to this user.*its group, "):
        find_statistics("tachobot")
    with pytest.raises(StatisticsFileError, match="no statistics of any board"):
        find_statistics()
    mine = default_path("tachobot")
    mine.touch()
    assert find_statistics("tachobot") == find_statistics() == mine


def test_a_file_in_the_place_of_a_board_is_said_to_have_an_option(tmp_path: Path) -> None:
    (file := tmp_path / "copy.stats").touch()
    with pytest.raises(StatisticsFileError, match=r"or --statistics .*copy\.stats for that file"):
        find_statistics(str(file))
    with pytest.raises(StatisticsFileError, match=r"a run in real time to have left some$"):
        find_statistics("nothing")
