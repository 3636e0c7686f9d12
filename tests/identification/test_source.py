"""A board that was never seen: a cart that a motor pushes, its position measured."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from firmware_runtime.board.experiments import Plant, Signal, plant_fault
from firmware_runtime.board.registry import Board, load
from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.identification.source import read_series


@dataclass(frozen=True)
class CartSettings:
    """All that the cart's plant asks of its settings."""

    newtons_per_volt: float = 0.5


CART = Plant(
    title="the cart",
    structure="translation",
    input=Signal(("motor.volts",), {"": 1.0}, scale=lambda settings: settings.newtons_per_volt),
    output=Signal(("ruler.seen", "ruler.raw"), {"left.mm": 0.001, "right.0": 0.002}),
    measures="position",
)


def stated(**changed: Any) -> Plant:  # noqa: ANN401 -- what is refused
    return replace(CART, **changed)


@pytest.fixture
def cart() -> Board:
    return replace(load("tachobot"), name="cart", settings=CartSettings(), plant=CART)


def test_weighted_numbers_of_a_trace_become_input_and_output(cart: Board, tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    lines = []
    for tick in range(250):
        at = tick * 10_000_000
        value = f'{{"left": {{"mm": {tick}}}, "right": [{tick}]}}'
        lines.append(f'{{"t_ns": {at}, "port": "ruler.raw", "value": {value}}}')
        lines.append(f'{{"t_ns": {at}, "port": "motor.volts", "value": {tick % 7}}}')
        lines.append(f'{{"t_ns": {at}, "port": "motor.volts", "value": {tick % 5}}}')
    trace.write_text("\n".join(lines))
    series = read_series(trace, cart)
    assert series.quantity == "position"
    assert series.at == pytest.approx(np.arange(250) * 0.01)
    assert series.measured == pytest.approx(np.arange(250) * 0.003)
    assert series.given == pytest.approx(np.arange(250) % 5 * 0.5)  # the last of an instant


BEFORE = '{"t_ns": 0, "port": "motor.volts", "value": 1}\n'


@pytest.mark.parametrize(
    "line",
    [
        b"{\x81'",
        b'{"a": ' + b"[" * 5000,
        b"7",
        b'{"t_ns": "1", "port": "ruler.raw", "value": 1}',
        b'{"t_ns": 1%s, "port": "ruler.raw", "value": 1}' % (b"0" * 400),
        b'{"t_ns": 1, "port": ["ruler.raw"], "value": 1}',
    ],
)
def test_what_is_no_line_of_a_trace_is_said(cart: Board, tmp_path: Path, line: bytes) -> None:
    trace = tmp_path / "run.trace"
    trace.write_bytes(BEFORE.encode() + line)
    with pytest.raises(ConfigError, match="line 2 is no message of a trace; expected t_ns, port"):
        read_series(trace, cart)


@pytest.mark.parametrize(
    "value", ["7", '{"left": {"mm": "x"}}', f'{{"left": {{"mm": 1{"0" * 400}}}}}']
)
def test_a_value_without_its_numbers_is_said(cart: Board, tmp_path: Path, value: str) -> None:
    trace = tmp_path / "run.trace"
    trace.write_text(f'{BEFORE}{{"t_ns": 1, "port": "ruler.raw", "value": {value}}}')
    with pytest.raises(ConfigError, match=r"no number at left\.mm of ruler\.seen; expected one"):
        read_series(trace, cart)


def test_a_table_may_leave_cells_empty(cart: Board, tmp_path: Path) -> None:
    table = tmp_path / "run.csv"
    rows = [f"{tick * 0.01},{tick % 9 if tick % 3 == 0 else ''},{tick}" for tick in range(300)]
    table.write_text("\n".join(["time_s,input,output", *rows]))
    series = read_series(table, cart, since_s=0.5)
    assert (len(series.given), len(series.measured)) == (100, 250)
    assert series.at[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    "plant",
    ["yaw", stated(structure="bending"), stated(measures="acceleration")],
)
def test_what_is_no_plant_is_a_fault_of_its_definition(plant: object) -> None:
    assert plant_fault(plant) is not None


def test_a_plant_and_none_are_sound() -> None:
    assert plant_fault(CART) is None
    assert plant_fault(None) is None


@pytest.mark.slow
def test_a_run_is_the_same_by_its_board_s_name_by_its_trace_and_by_run_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    trace, recording = tmp_path / "run.trace", tmp_path / "run.part"
    words = ["run", "tachobot", "--doubles", "--clock", "virtual", "--for", "3", "--json"]
    assert main([*words, "--trace", str(trace), "--record", str(recording)]) == 0
    board = load("tachobot")
    by_name = read_series("tachobot", board)
    assert len(by_name.measured) > 200
    for path in (trace, recording):
        other = read_series(path, board)
        assert np.array_equal(by_name.given, other.given)
        assert np.array_equal(by_name.given_at, other.given_at)
        assert np.array_equal(by_name.measured, other.measured)
        assert np.array_equal(by_name.at, other.at)


@pytest.mark.slow
@pytest.mark.real_time
def test_the_recording_of_the_end_that_computes_has_what_came_in_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    words = ["run", "tachobot", "--stage", "network", "--for", "3", "--json"]
    assert main([*words, "--record", str(tmp_path / "run.recording")]) == 0
    series = read_series(tmp_path / "run.recording", load("tachobot"))
    assert min(len(series.given), len(series.measured)) > 20


def test_a_run_that_is_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    assert main(["identify", "tachobot", "--from", "tachobot"]) == Status.BAD_INPUT
    assert "tachobot: no file, and no run of a board" in capsys.readouterr().err
