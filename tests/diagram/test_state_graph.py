import re
from xml.etree import ElementTree as ET

import pytest
from firmware_boards.detective.detective import Detective

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.devs.wiring import Wiring
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State
from firmware_runtime.view.diagram.diagram_look import duration_text, wrap
from firmware_runtime.view.diagram.draw import diagram

SVG = "{http://www.w3.org/2000/svg}"


def shapes(picture: str, tag: str, css: str) -> list[ET.Element]:
    """Elements of one kind and class; parsing also shows that the picture is well-formed."""
    root = ET.fromstring(picture)  # noqa: S314 -- our own picture
    return [each for each in root.iter(SVG + tag) if css in each.get("class", "").split()]


def texts(picture: str, css: str) -> list[str]:
    return [each.text or "" for each in shapes(picture, "text", css)]


def state_diagrams() -> list[StateDiagram]:
    """The robot's, one of each table."""
    found = [each for each in Wiring(Detective()).atomics if isinstance(each, StateDiagram)]
    return list({id(each.states): each for each in found}.values())


def numbers(element: ET.Element, *names: str) -> tuple[float, ...]:
    return tuple(float(element.get(name, "nan")) for name in names)


@pytest.mark.parametrize("model", state_diagrams(), ids=lambda model: model.name)
def test_every_state_and_every_arrow_of_the_table_is_in_the_picture(model: StateDiagram) -> None:
    picture = diagram(model, model.name)
    drawn = shapes(picture, "circle", "state")
    assert len(drawn) == len(model.states)
    said = " ".join(texts(picture, "name"))
    assert said == " ".join(state.name for state in model.states)
    assert texts(picture, "note")[: len(drawn)] == [
        duration_text(model.durations[state.name]) for state in model.states
    ]
    arrows = [arrow for state in model.states for arrow in state.arrows]
    for kind, is_external in (("external", True), ("internal", False)):
        labels = " ".join(texts(picture, f"{kind}-label")).split()
        expected = [a.label.split() for a in arrows if a.is_external == is_external]
        for label in expected:
            assert set(label) <= set(labels)


@pytest.mark.parametrize("model", state_diagrams(), ids=lambda model: model.name)
def test_no_two_states_overlap_and_none_leaves_the_picture(model: StateDiagram) -> None:
    picture = diagram(model, model.name)
    circles = [numbers(each, "cx", "cy", "r") for each in shapes(picture, "circle", "state")]
    for number, (x, y, radius) in enumerate(circles):
        for other_x, other_y, other_radius in circles[:number]:
            distance = ((x - other_x) ** 2 + (y - other_y) ** 2) ** 0.5
            assert distance > radius + other_radius + 40
    root = ET.fromstring(picture)  # noqa: S314 -- our own picture
    left, top, width, height = map(float, (root.get("viewBox") or "").split())
    for x, y, radius in circles:
        assert left < x - radius < x + radius < left + width
        assert top < y - radius < y + radius < top + height


def test_internal_arrows_are_dashed_and_external_ones_solid() -> None:
    picture = diagram(Detective(), "radar_controller")
    assert len(shapes(picture, "path", "internal")) == 5 + 1  # the legend shows one of each
    assert len(shapes(picture, "path", "external")) == 4 + 1
    style = picture[picture.index("<style>") : picture.index("</style>")]
    dashed = {rule.split("{")[0].strip() for rule in style.split("}") if "dasharray" in rule}
    assert dashed == {".internal"}


def test_the_picture_is_self_contained_and_has_colours_for_light_and_dark() -> None:
    picture = diagram(Detective(), "radar_controller")
    assert re.findall(r'(?:href|src|url|@import)\s*[=("]', picture) == []
    assert "@media (prefers-color-scheme: dark)" in picture


def test_the_same_model_gives_the_same_bytes() -> None:
    assert diagram(Detective(), "motor1") == diagram(Detective(), "motor1")


class Alone(StateDiagram):
    def __init__(self, *states: State) -> None:
        super().__init__("alone")
        self.tick = self.in_port("tick", int)
        self.out = self.out_port("out", int)
        self.follow(states)


def test_a_single_state_with_arrows_to_itself_can_be_drawn() -> None:
    picture = diagram(
        Alone(State("On <&>", 5, Arrow("tick?1", "On <&>"), Arrow("out!1", "On <&>"))), "alone"
    )
    assert texts(picture, "external-label")[0] == "tick?1"
    assert len(shapes(picture, "path", "internal")) == 2


def test_an_arrow_without_a_label_is_drawn_without_one() -> None:
    picture = diagram(Alone(State("a", 5, Arrow("", "b")), State("b", NEVER)), "alone")
    assert len(shapes(picture, "path", "internal")) == 2
    assert texts(picture, "internal-label") == ["port!value"]


def test_arrows_of_one_kind_between_two_states_are_drawn_as_one_with_all_labels() -> None:
    picture = diagram(Detective(), "movement_controller")
    assert len(shapes(picture, "path", "internal")) == 6 + 1
    labels = texts(picture, "internal-label")
    assert labels.count("[angles grow]") == labels.count("[angles fall]") == 2


@pytest.mark.parametrize(
    "name",
    ["radarController", "radar_controller", "RADARCONTROLLER", "top.RadarSystem.radarController"],
)
def test_a_model_is_found_by_name_or_path_without_case_and_underscores(name: str) -> None:
    assert "States of top.RadarSystem.radarController" in diagram(Detective(), name)


def test_a_name_without_a_state_diagram_is_refused_with_those_that_have_one() -> None:
    with pytest.raises(ConfigError, match=r"'RadarSystem': no such model .* top\.RadarSystem\.son"):
        diagram(Detective(), "RadarSystem")


def test_a_model_without_any_state_diagram_is_said_to_have_none() -> None:
    with pytest.raises(ConfigError, match=r"'room': no such model .*; there is none in this model"):
        diagram(Coupled("house"), "room")


def test_mermaid_gets_the_whole_table() -> None:
    lines = diagram(Detective(), "radar_controller", "mmd").splitlines()
    assert lines[:4] == [
        "stateDiagram-v2",
        "    [*] --> s0",
        "    s0 : Idle (\N{INFINITY})",
        "    s1 : Prepare for Working (10 ms)",
    ]
    assert lines[9:] == [
        "    s0 --> s1 : radar_in1?1",
        "    s1 --> s2 : radar_out1!1",
        "    s2 --> s3 : radar_out1!2",
        "    s2 --> s4 : radar_in2?1",
        "    s3 --> s2 : radar_out1!1",
        "    s3 --> s4 : radar_in2?1",
        "    s4 --> s5 : radar_out1!0 radar_out2!1 radar_out3!1",
        "    s5 --> s6 : radar_in3?degree",
        "    s6 --> s0 : radar_out2!degree",
    ]


@pytest.mark.parametrize(
    ("duration", "text"),
    [
        (NEVER, "\N{INFINITY}"),
        (3 * SECOND, "3 s"),
        (1500 * MILLISECOND, "1.5 s"),
        (10 * MILLISECOND, "10 ms"),
        (2500, "2.5 us"),
        (7, "7 ns"),
        (0, "0 ns"),
    ],
)
def test_durations_are_said_with_the_largest_unit_they_reach(duration: int, text: str) -> None:
    assert duration_text(duration) == text


def test_lines_break_between_words_only() -> None:
    assert wrap("a counterclockwise turn to it", 9) == ["a", "counterclockwise", "turn to", "it"]
