"""Sweeps of boards: tables that are the same however they were made, resumed, and read again."""

import resource
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps import Table, sweep
from firmware_runtime.lab.sweeps.partial import Partial, partial_of
from firmware_runtime.lab.sweeps.plan import Sweep
from firmware_runtime.lab.sweeps.row import Row, run_row
from firmware_runtime.lab.sweeps.sweep_table import read_table, sweep_of, write_table
from firmware_runtime.lab.sweeps.sweeping import carry_out

VARY = {"world.mass_kg": "uniform(2, 4)", "world.seed": "range(6)"}
SHORT = Sweep(board="tachobot", vary=VARY, for_s=1.5)


@pytest.mark.slow
def test_one_process_and_several_write_the_same_bytes(tmp_path: Path) -> None:
    for ending in (".csv", ".parquet"):
        here, there = tmp_path / f"one{ending}", tmp_path / f"several{ending}"
        carry_out(SHORT, here, workers=1)
        carry_out(SHORT, there, workers=2)
        assert here.read_bytes() == there.read_bytes()
        assert read_table(here).rows == [run_row(SHORT, row) for row in range(6)]
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.slow
def test_a_row_holds_all_that_its_run_needs() -> None:
    table = carry_out(SHORT, None, workers=1)
    row = table.row(4)
    again = run_row(sweep_of(row), 0)
    same = row.keys() - {"row", "seed", *VARY}
    assert {name: row[name] for name in same} == {name: again[name] for name in same}
    assert row["outcome"] == "ended"
    assert row["statistics.skipped"] == 0
    assert row["world.seed"] == 4


@pytest.mark.slow
def test_a_sweep_that_was_cut_short_goes_on_to_the_same_table(tmp_path: Path) -> None:
    whole, resumed = tmp_path / "whole.csv", tmp_path / "resumed.csv"
    carry_out(SHORT, whole, workers=1)

    class Killed(BaseException):
        pass

    def stop(done: int, _size: int, _failed: int) -> None:
        if done == 4:
            raise Killed

    with pytest.raises(Killed):
        carry_out(SHORT, resumed, workers=1, progress=stop)
    assert not resumed.exists()
    with partial_of(resumed).open("ab") as file:
        file.write(b'{"row":4,"torn')
    done: list[int] = []
    carry_out(SHORT, resumed, workers=1, resume=True, progress=lambda now, *_: done.append(now))
    assert resumed.read_bytes() == whole.read_bytes()
    assert done == [5, 6]
    assert not partial_of(resumed).exists()


def divided_by_zero(done: int, _size: int, _failed: int) -> None:
    assert done // 0


def test_rows_of_another_sweep_are_not_gone_on_with(tmp_path: Path) -> None:
    output = tmp_path / "table.csv"
    with pytest.raises(ZeroDivisionError):
        carry_out(SHORT, output, workers=1, progress=divided_by_zero)
    kept = partial_of(output).read_bytes()
    for another in (msgspec.structs.replace(SHORT, seed=1), SHORT):
        is_same = another is SHORT
        with pytest.raises(ConfigError, match="--resume" if is_same else "world.seed=range"):
            carry_out(another, output, workers=1, resume=not is_same)
        assert partial_of(output).read_bytes() == kept


@pytest.mark.slow
def test_a_run_that_fails_is_a_row() -> None:
    vary = {
        "world.coulomb_friction_nm": "linspace(0, 0.02, 3)",
        "thrust_pairs.address": "range(64, 65)",
    }
    table = sweep("tachobot", vary, set={"world.static_friction_nm": 0.01}, for_s=1.5, workers=1)
    assert table.column("outcome") == ["ended", "ended", "refused"]
    assert "world.static_friction_nm: 0.01 N m, expected at least" in str(table.row(2)["error"])
    assert table.row(2)["world.coulomb_friction_nm"] == 0.02


def test_everything_wrong_is_said_at_once_before_any_run(tmp_path: Path) -> None:
    vary = {"world.mas_kg": "uniform(2, 4)", "world.mass_kg": "uniform(4, 2)", "world.seed": "one"}
    with pytest.raises(ConfigError) as refused:
        sweep("tachobot", vary, runs=0, output=tmp_path / "no" / "table.csv", workers=0)
    said = "\n".join(refused.value.faults)
    assert len(refused.value.faults) == 6
    for words in ("did you mean mass_kg", "uniform(LOW, HIGH)", "'one'", "--runs", "-o:", "--work"):
        assert words in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"board": "tachobt"}, "did you mean tachobot"),
        ({"vary": {}}, "nothing is varied"),
        ({"vary": {"world.mass_kg": "uniform(2, 4)"}}, "expected how many runs"),
        ({"assignments": ["world.seed=3"]}, "--set states it too"),
        ({"experiment": "yaw-stop"}, "did you mean yaw-step"),
        ({"vary": {"world.seed": "uniform(1, 2)"}, "runs": 2}, "expected int, got float"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        carry_out(msgspec.structs.replace(SHORT, **wrong), None, workers=1)


def test_csv_gives_back_what_was_written(tmp_path: Path) -> None:
    cells = [0, -1, 2**60, 0.1, 1e-300, -0.0, True, False, None, "", "a", "1.0", "true", "a,b\n'\""]
    known: Row = {"row": 0, "board": "tachobot", "outcome": "ended"}
    table = Table([{**known, **{f"k.{n}": cell for n, cell in enumerate(cells)}}])
    write_table(table, tmp_path / "table.csv")
    found = read_table(tmp_path / "table.csv").row(0)
    back = [found[f"k.{n}"] for n in range(len(cells))]
    assert list(map(repr, back)) == list(map(repr, cells))


def test_what_is_no_table_is_refused(tmp_path: Path) -> None:
    for name, content in (("c.parquet", "PAR1"), ("d", "")):
        (tmp_path / name).write_text(content)
        with pytest.raises(ConfigError, match=name):
            read_table(tmp_path / name)
    for name in ("none.csv", "none.parquet"):
        with pytest.raises(ConfigError, match="No such file"):
            read_table(tmp_path / name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("board", "key", "words"),
    [
        ("balancing", "world.body_mass_kg", "linspace(0.7, 0.9, 2)"),
        ("pan_tilt", "world.azimuth_rad", "linspace(0.5, 0.9, 2)"),
    ],
)
def test_any_robot_can_be_swept(board: str, key: str, words: str) -> None:
    table = sweep(board, {key: words}, for_s=1.5, workers=1)
    assert table.column("outcome") == ["ended", "ended"]
    assert table.figures


def test_a_sweep_that_could_not_begin_leaves_no_file(tmp_path: Path) -> None:
    output = tmp_path / "table.csv"
    with Partial(partial_of(output), SHORT, "1", resume=False):
        assert partial_of(output).exists()
    assert not partial_of(output).exists()


@pytest.fixture
def little_room() -> Iterator[None]:
    """No file of this process grows beyond 400 bytes, as on a disk that is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("little_room")
def test_a_disk_without_room_for_a_row_is_a_sentence_and_keeps_those_before(tmp_path: Path) -> None:
    kept_at = partial_of(tmp_path / "table.csv")
    rows: list[Row] = [{"row": number, "error": "x" * 30} for number in range(9)]

    def keep_all() -> None:
        with Partial(kept_at, SHORT, "1", resume=False) as partial:
            for row in rows:
                partial.keep(row)

    with pytest.raises(ConfigError, match="expected room for more rows"):
        keep_all()
    assert kept_at.stat().st_size == 400
    with Partial(kept_at, SHORT, "1", resume=True) as again:
        found = again.rows
    assert found
    assert list(found.values()) == rows[: len(found)]


@pytest.mark.parametrize(
    "line", [b"{", b'{"row": "x"}', b'["\xe3("]', b'{"board": "x"}', b"[" * 9999]
)
def test_a_row_that_is_damaged_is_refused_and_nothing_is_lost(tmp_path: Path, line: bytes) -> None:
    kept_at = partial_of(tmp_path / "table.csv")
    with Partial(kept_at, SHORT, "1", resume=False) as partial:
        partial.keep({"row": 0, "at_s": 1.0})
    content = kept_at.read_bytes() + line + b"\n"
    kept_at.write_bytes(content)
    with pytest.raises(ConfigError, match="a line is no finished row"):
        Partial(kept_at, SHORT, "1", resume=True)
    assert kept_at.read_bytes() == content


@pytest.mark.parametrize("resume", [True, False])
def test_a_second_sweep_into_the_same_file_is_refused_while_one_is_at_it(
    tmp_path: Path, *, resume: bool
) -> None:
    kept_at = partial_of(tmp_path / "table.csv")
    with Partial(kept_at, SHORT, "1", resume=False) as first:
        with pytest.raises(ConfigError, match="another one writes it"):
            Partial(kept_at, SHORT, "1", resume=resume)
        first.keep({"row": 0})
    with pytest.raises(ConfigError, match="did not end; expected --resume"):
        Partial(kept_at, SHORT, "1", resume=False)
    with Partial(kept_at, SHORT, "1", resume=True) as second:
        assert second.rows == {0: {"row": 0}}


def test_a_distribution_that_is_no_text_is_refused_by_a_sentence() -> None:
    with pytest.raises(ConfigError, match=r"world\.seed: range.*expected a text"):
        sweep("tachobot", {"world.seed": range(2)}, workers=1)  # type: ignore[dict-item]


@pytest.mark.parametrize("runs", [2.5, "3", 0])
def test_runs_that_are_no_whole_number_are_refused(runs: object) -> None:
    with pytest.raises(ConfigError, match=r"--runs: .*; expected a whole number"):
        sweep("tachobot", {"world.seed": "uniform(1, 9)"}, runs=runs)  # type: ignore[arg-type]
