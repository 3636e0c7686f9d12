"""The detective's model, its file and Figure 6."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from firmware_boards.detective.detective import ATOMIC_CLASSES, MODEL_FILE, Detective
from firmware_boards.detective.parameters import Parameters
from firmware_boards.detective.sensors import Compass2
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.devs.wiring import Wiring, sources_of
from firmware_runtime.ecdpp.event_file import Event, parse_events
from firmware_runtime.ecdpp.experiment import run_events
from firmware_runtime.ecdpp.model_file import parse_model, read_model
from firmware_runtime.models.state_diagram import StateDiagram
from tests.support.figure_6 import EVENTS, OUTPUTS


def flat_couplings(model: Coupled) -> Iterator[tuple[str, str]]:
    """From port to port of atomic models and of the model itself."""
    wiring = Wiring(model)
    sources: list[AnyPort] = list(model.in_ports.values())
    sources += [port for atomic in wiring.atomics for port in atomic.out_ports.values()]
    for source in sources:
        yield from ((source.path, end.path) for end in wiring.ends(source))
    for out in model.out_ports.values():
        yield from ((source.path, out.path) for source in sources_of(out))


def ports(model: Component) -> list[tuple[str, type]]:
    """Every port at every level and its type."""
    own = [(port.path, port.type) for port in model.in_ports.values()]
    own += [(port.path, port.type) for port in model.out_ports.values()]
    inner = model.components.values() if isinstance(model, Coupled) else ()
    return own + [each for component in inner for each in ports(component)]


def durations(model: Coupled) -> list[tuple[str, dict[str, int]]]:
    diagrams = (each for each in Wiring(model).atomics if isinstance(each, StateDiagram))
    return [(atomic.path, atomic.durations) for atomic in diagrams]


def test_the_model_file_builds_the_same_model_as_the_wiring_with_its_ports_and_defaults() -> None:
    built, wired = read_model(MODEL_FILE, ATOMIC_CLASSES), Detective()
    assert list(flat_couplings(built)) == list(flat_couplings(wired))
    assert len(list(flat_couplings(wired))) == 20
    assert ports(built) == ports(wired)
    assert durations(built) == durations(wired)
    assert len(durations(built)) == 9
    assert Parameters() == Parameters(10 * MILLISECOND, 3 * SECOND, 0.0), "as the README lists them"


def test_parameters_of_the_model_file_reach_the_models() -> None:
    text = MODEL_FILE.read_text(encoding="utf-8")
    text = text.replace("turnTime : 00:00:03:000", "turnTime : 00:00:04:50")
    text = text.replace("tolerance : 0", "tolerance : 2.5")
    model = parse_model(text, "changed.ma", ATOMIC_CLASSES)
    by_path = {atomic.path: atomic for atomic in Wiring(model).atomics}
    radar = by_path["top.RadarSystem.radarController"]
    compass2 = by_path["top.MovingSystem.compass2"]
    assert isinstance(radar, StateDiagram)
    assert isinstance(compass2, Compass2)
    assert radar.durations["Ask motor1 to turn left"] == 4 * SECOND + 50 * MILLISECOND
    assert compass2.tolerance_deg == 2.5


@pytest.mark.parametrize(
    ("model", "states"),
    [
        (
            "radarController",
            [
                "Idle",
                "Prepare for Working",
                "Ask motor1 to turn right",
                "Ask motor1 to turn left",
                "Ask motor1 and MC to stop",
                "Wait compass1 degree",
                "Send mess. degree to MC",
            ],
        ),
        (
            "movementController",
            [
                "Stop",
                "Prepare to move forward",
                "Moving forward",
                "Ask MC to stop",
                "Wait radar mess",
                "Prepare to receive",
                "Wait to receive",
                "Prepare to turn",
                "Turn",
                "Ask to prepare to Move forward",
                "Move forward",
                "Ask to prepare to stop",
            ],
        ),
    ],
)
def test_the_states_are_those_of_the_papers_set_s(model: str, states: list[str]) -> None:
    atomics = {atomic.name: atomic for atomic in Wiring(Detective()).atomics}
    controller = atomics[model]
    assert isinstance(controller, StateDiagram)
    assert [state.name for state in controller.states] == states


LINES = OUTPUTS.splitlines()


def from_model_file() -> Coupled:
    return read_model(MODEL_FILE, ATOMIC_CLASSES)


@pytest.mark.parametrize("build", [Detective, from_model_file])
def test_figure_6_comes_out_line_by_line(build: Callable[[], Coupled]) -> None:
    model = build()
    events = parse_events(EVENTS, "figure 6", model)
    until = 3600 * SECOND  # nothing is due afterwards
    assert [str(line) for line in run_events(model, events, until, checked=True)] == LINES
    shipped = Path(__file__).parents[2] / "boards/firmware_boards/detective/figure6.ev"
    assert shipped.read_text(encoding="utf-8") == EVENTS


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
