from itertools import pairwise
from xml.etree import ElementTree as ET

import pytest
from firmware_boards.detective.detective import Detective

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import Owner
from firmware_runtime.view.diagram.boxes import Box, Node
from firmware_runtime.view.diagram.canvas import Point
from firmware_runtime.view.diagram.coupling_diagram import box_of
from firmware_runtime.view.diagram.draw import diagram
from firmware_runtime.view.diagram.placement import assign
from firmware_runtime.view.diagram.routes import Trunk

SVG = "{http://www.w3.org/2000/svg}"


def all_components(model: Component) -> list[Component]:
    inner = model.components.values() if isinstance(model, Coupled) else ()
    return [model, *(each for component in inner for each in all_components(component))]


def all_couplings(model: Component) -> list[str]:
    return [
        f"{source.path} \N{RIGHTWARDS ARROW} {end.path}"
        for each in all_components(model)
        if isinstance(each, Coupled)
        for source, end in each.couplings
    ]


class Stage(Atomic):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.entrance = self.in_port("in", int)
        self.back = self.in_port("back", int)
        self.out = self.out_port("out", int)


class Ring(Coupled):
    """Three stages in a row, a short cut, and the last one's output fed back to all."""

    def __init__(self) -> None:
        super().__init__("ring")
        start, out = self.in_port("start", int), self.out_port("out", int)
        first, second, third = (self.add(Stage(name)) for name in ("first", "second", "third"))
        self.couple(start, first.entrance)
        self.couple(start, third.entrance)
        self.couple(first.out, second.entrance)
        self.couple(second.out, third.back)
        self.couple(third.out, out)
        self.couple(third.out, first.back)
        self.couple(third.out, second.back)


class Through(Coupled):
    """A model that passes its input on, beside a component or without any."""

    def __init__(self) -> None:
        super().__init__("through")
        start, out = self.in_port("start", int), self.out_port("out", int)
        empty, stage = self.add(Coupled("empty")), self.add(Stage("stage"))
        entrance, leaving = empty.in_port("in", int), empty.out_port("out", int)
        empty.couple(entrance, leaving)
        self.couple(start, out)
        self.couple(start, entrance)
        self.couple(leaving, stage.entrance)


MODELS = (Detective(), Ring(), Through())


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_every_model_port_and_coupling_is_in_the_picture(model: Coupled) -> None:
    root = ET.fromstring(diagram(model))  # noqa: S314 -- our own picture
    texts = [each.text for each in root.iter(SVG + "text") if each.text]
    components = all_components(model)
    ports = [name for each in components for name in (*each.in_ports, *each.out_ports)]
    assert sorted(texts, key=str) == sorted([*(each.name for each in components), *ports])
    tooltips = [each.text for path in root.iter(SVG + "path") for each in path]
    assert sorted(tooltips, key=str) == sorted(all_couplings(model))


def inner_boxes(box: Box) -> list[Box]:
    return [box, *(each for _, part in box.parts for each in inner_boxes(part))]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_boxes_stand_apart_within_their_box(model: Coupled) -> None:
    for box in inner_boxes(box_of(model)):
        for number, (node, part) in enumerate(box.parts):
            assert node.x > 0
            assert node.y > 0
            assert node.x + part.width < box.width
            assert node.y + part.height < box.height
            for other, other_part in box.parts[:number]:
                assert (
                    node.x >= other.x + other_part.width
                    or other.x >= node.x + part.width
                    or node.y >= other.y + other_part.height
                    or other.y >= node.y + part.height
                )


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_wires_run_from_port_to_port_and_round_the_boxes(model: Coupled) -> None:
    for box in inner_boxes(box_of(model)):
        places: dict[Owner, tuple[Node, Box]] = {
            part.model: (node, part) for node, part in box.parts
        }
        for source, end, route in box.routes:
            if source.owner is box.model:
                assert route[0] == Point(0, box.inputs[source.name])
            else:
                node, part = places[source.owner]
                x, y = node.x + part.width, node.y + part.outputs[source.name]
                assert route[0] == pytest.approx((x, y))
            if end.owner is box.model:
                assert route[-1] == Point(box.width, box.outputs[end.name])
            else:
                node, part = places[end.owner]
                assert route[-1] == pytest.approx((node.x, node.y + part.inputs[end.name]))
            for one, other in pairwise(route):
                assert one.x == other.x or one.y == other.y
                assert not any(crosses(one, other, node, part) for node, part in box.parts)


def crosses(one: Point, other: Point, corner: Node, part: Box) -> bool:
    """Whether a straight piece of wire runs through a box."""
    return (
        max(one.x, other.x) > corner.x + 0.1
        and min(one.x, other.x) < corner.x + part.width - 0.1
        and max(one.y, other.y) > corner.y
        and min(one.y, other.y) < corner.y + part.height
    )


def test_what_feeds_stands_left_of_what_is_fed() -> None:
    wires = [("a", "b"), ("b", "c"), ("a", "c"), ("d", "c")]
    assert assign(["c", "d", "a", "b"], wires) == {"c": 3, "d": 1, "a": 1, "b": 2}


def test_of_two_that_feed_each_other_the_first_declared_stands_left() -> None:
    wires = [("controller", "sensor"), ("sensor", "controller"), ("controller", "motor")]
    assert assign(["sensor", "controller", "motor"], wires) == {
        "sensor": 1,
        "controller": 2,
        "motor": 3,
    }


def test_a_level_wire_needs_no_track() -> None:
    assert Trunk({10.0}, {10.0}).is_point
    assert not Trunk({10.0}, {10.0, 30.0}).is_point
    assert not Trunk({10.0}, set(), is_deep=True).is_point


def test_an_atomic_model_alone_is_a_box_with_its_ports() -> None:
    picture = diagram(Stage("alone"))
    assert [text in picture for text in (">alone<", ">in<", ">back<", ">out<")] == [True] * 4


def test_a_coupled_model_with_nothing_in_it_can_be_drawn() -> None:
    assert ">empty<" in diagram(Coupled("empty"))


def test_mermaid_gets_every_model_and_every_coupling() -> None:
    lines = [line.strip() for line in diagram(Ring(), form="mmd").splitlines()]
    assert lines == [
        "flowchart LR",
        'subgraph model__ring["ring"]',
        'model__ring__start(["start"])',
        'model__ring__out(["out"])',
        'model__ring__first["first"]',
        'model__ring__second["second"]',
        'model__ring__third["third"]',
        "end",
        'model__ring__start -->|"in"| model__ring__first',
        'model__ring__start -->|"in"| model__ring__third',
        'model__ring__first -->|"out to in"| model__ring__second',
        'model__ring__second -->|"out to back"| model__ring__third',
        'model__ring__third -->|"out"| model__ring__out',
        'model__ring__third -->|"out to back"| model__ring__first',
        'model__ring__third -->|"out to back"| model__ring__second',
    ]


def test_mermaid_gets_nested_models_with_their_own_frames() -> None:
    text = diagram(Detective(), form="mmd")
    assert '        subgraph model__top__RadarSystem["RadarSystem"]\n' in text
    assert text.count("subgraph") == text.count("end\n") == 3
    assert text.count("-->") == len(all_couplings(Detective()))


def test_letters_that_mean_something_to_mermaid_are_written_by_number() -> None:
    text = diagram(Coupled('a "b" -> c'), form="mmd")
    assert '["a #34;b#34; -#62; c"]' in text
    assert "subgraph model__au20_u22_bu22_u20_u2d_u3e_u20_c[" in text
