from collections.abc import Callable
from pathlib import Path

import pytest
from firmware_boards.detective.detective import ATOMIC_CLASSES, MODEL_FILE, Detective
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.ecdpp.event_file import Event, parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import read_model
from tests.support.figure_6 import EVENTS, OUTPUTS

LINES = OUTPUTS.splitlines()


def from_model_file() -> Coupled:
    return read_model(MODEL_FILE, ATOMIC_CLASSES)


@pytest.mark.parametrize("build", [Detective, from_model_file])
def test_figure_6_comes_out_line_by_line(build: Callable[[], Coupled]) -> None:
    model = build()
    events = parse_events(EVENTS, "figure 6", model)
    assert [str(line) for line in run_events(model, events, checked=True)] == LINES


def test_nothing_is_due_after_figure_6() -> None:
    model = Detective()
    events = parse_events(EVENTS, "figure 6", model)
    assert len(run_events(model, events, until=3600 * SECOND)) == len(LINES)


def at(
    port: str, values: st.SearchStrategy[float], begin_ms: int, end_ms: int
) -> st.SearchStrategy[Event]:
    """Events for a port in a span of milliseconds, its end not included."""
    return st.builds(
        Event,
        st.integers(begin_ms * MILLISECOND, end_ms * MILLISECOND - 1),
        st.just(port),
        values,
    )


NUMBERS = st.floats(-1000, 1000)
NOT_ONE = NUMBERS.filter(lambda value: value != 1)
NO_MATCH = NUMBERS.filter(lambda value: (value - 200) % 360 > 1e-6)
UNNAMED = st.one_of(
    at("In1", NOT_ONE, 0, 20_000),
    at("In1", st.just(1.0), 2_000, 15_020),
    at("In2", NOT_ONE, 0, 20_000),
    at("In2", st.just(1.0), 0, 2_010),
    at("In2", st.just(1.0), 5_001, 20_000),
    at("In3", NUMBERS, 0, 5_020),
    at("In3", NUMBERS, 6_001, 20_000),
    at("In4", NUMBERS, 0, 6_030),
    at("In4", NUMBERS, 9_001, 9_020),
    at("In4", NO_MATCH, 9_020, 11_050),
    at("In4", NUMBERS, 11_051, 20_000),
    at("In5", st.just(0.0), 0, 20_000),
    at("In5", NUMBERS, 0, 11_070),
    at("In5", NUMBERS, 15_001, 20_000),
)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.lists(UNNAMED, max_size=20))
def test_inputs_that_no_state_names_change_nothing_in_figure_6(unnamed: list[Event]) -> None:
    model = Detective()
    events = sorted([*parse_events(EVENTS, "figure 6", model), *unnamed])
    assert [str(line) for line in run_events(model, events)] == LINES


def test_the_event_file_that_comes_with_the_board_is_that_of_figure_6() -> None:
    shipped = Path(__file__).parents[2] / "boards/firmware_boards/detective/figure6.ev"
    assert shipped.read_text(encoding="utf-8") == EVENTS
