"""The picture of a run: well-formed, to scale, complete, and readable in both schemes."""

import math
import re
import sys
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.view.canvas import text_width
from firmware_runtime.view.diagram.picture_file import require_renderer, write_picture
from firmware_runtime.view.scales import Axis
from sim_doubles.worlds.arena import ArenaParameters
from sim_doubles.worlds.arena_log import ArenaLog, Stay
from sim_doubles.worlds.arena_picture import draw_run
from sim_doubles.worlds.arena_picture_time import hues_of
from tests.support.arena_mission import ArenaMission
from tests.support.arena_rig import ArenaRig

TITLE = "found <it> & stopped"


@pytest.fixture(scope="module")
def mission() -> ArenaMission:
    parameters = ArenaParameters(
        target=(1.5, 1.2), obstacles=((-2.0, 1.0, 0.3),), walls=((-3.0, -1.0, 3.0, -1.0),)
    )
    done = ArenaMission(parameters)
    done.run()
    return done


@pytest.fixture(scope="module")
def svg(mission: ArenaMission) -> ET.Element:
    return ET.fromstring(draw_run(mission.log, mission.at, TITLE))  # noqa: S314 -- it is our own


def shapes(svg: ET.Element, css: str) -> list[ET.Element]:
    """Everything that has this class."""
    return [element for element in svg.iter() if css in element.get("class", "").split()]


def key_of(svg: ET.Element) -> list[ET.Element]:
    """The shapes of the key, right of the map."""
    frame = shapes(svg, "frame")[0]
    edge = float(frame.get("x", "")) + float(frame.get("width", ""))
    return [shape for shape in svg if left_of(shape) > edge]


def left_of(shape: ET.Element) -> float:
    """Where a shape begins, roughly: its centre, its corner or its first point."""
    stated = shape.get("cx") or shape.get("x")
    found = re.match(r"M([-\d.]+)", shape.get("d", ""))
    return float(stated or (found[1] if found else 0.0))


def texts(svg: ET.Element) -> list[str | None]:
    return [element.text for element in svg.iter() if element.tag.endswith("}text")]


def test_title_axes_units_and_models_are_written_out_and_every_state_named_once(
    svg: ET.Element,
) -> None:
    words = [TITLE, "x, east (m)", "y, north (m)", "distance (m)", "time (s)", "mission"]
    assert {*words} <= {*texts(svg)}
    for state in ("search", "turn", "approach", "stop"):
        assert texts(svg).count(state) == 1


def test_radar_echoes_are_drawn_one_by_one_and_the_rest_as_one_fan(
    mission: ArenaMission, svg: ET.Element
) -> None:
    echoes = sum(ping.echo_m < math.inf for ping in mission.log.radar_pings)
    assert echoes == 1
    key = 1
    assert len(shapes(svg, "radar-edge")) == echoes + key
    fan = shapes(svg, "sweep")[0].get("d", "")
    assert fan.count("Z") == len(mission.log.radar_pings) - echoes


def test_the_vehicle_ends_on_the_map_where_it_ended_in_the_arena(
    mission: ArenaMission, svg: ET.Element
) -> None:
    target, vehicle = (
        shapes(svg, "target")[0],
        next(each for each in shapes(svg, "solid") if each not in key_of(svg)),
    )
    scale = float(target.get("r", "")) / 0.10
    end = mission.rig.arena.pose(mission.at)
    east, north = (float(target.get("cx", "")), float(target.get("cy", "")))
    assert float(vehicle.get("cx", "")) - east == pytest.approx((end.x_m - 1.5) * scale, abs=1.0)
    assert north - float(vehicle.get("cy", "")) == pytest.approx((end.y_m - 1.2) * scale, abs=1.0)


@pytest.mark.parametrize(
    ("outcome", "first", "lines"), [("It found the target.", "It", 1), ("word " * 80, "word", 2)]
)
def test_the_outcome_stands_below_the_title_and_stays_on_the_page(
    mission: ArenaMission, outcome: str, first: str, lines: int
) -> None:
    svg = ET.fromstring(draw_run(mission.log, mission.at, "title", outcome))  # noqa: S314
    found = [text for text in texts(svg) if text and text.startswith(f"{first} ")]
    assert len(found) == lines
    assert all(text_width(line) <= 1000 for line in found)
    drawn = " ".join(" ".join(found).split())
    assert outcome.startswith(drawn.removesuffix("..."))  # as far as there is room
    assert svg.get("aria-label") == f"title: {outcome}"


def test_the_key_has_the_colours_of_the_map(svg: ET.Element) -> None:
    """Every class on the map is in the key; the path's by state, those it moved in."""
    key = {css for shape in key_of(svg) for css in shape.get("class", "").split()}
    hues = {css for path in shapes(svg, "path") for css in path.get("class", "").split()}
    assert hues - {"hue-brief"} > {"path"}
    moved = {text for text in texts(svg) if text and text.startswith("its path: ")}
    assert moved == {"its path: search", "its path: approach"}
    drawn = {css for shape in shapes(svg, "beam") for css in shape.get("class", "").split()}
    assert drawn <= key
    assert "goal-zone" not in key


def test_beams_are_one_figure_a_sonar_on_paper_so_that_no_colours_mix(svg: ET.Element) -> None:
    order = [each.get("class") for each in svg.iter() if each.tag.endswith("path")]
    for css in ("radar", "body"):
        first = order.index(f"beam {css}")
        assert order[first - 1] == "paper"
        assert order.count(f"beam {css}") == 2  # one of them in the key
    assert order.index("beam body") < order.index("path hue0")


def test_every_class_has_a_rule_both_schemes_colour_the_same_and_models_share_no_colour(
    mission: ArenaMission, svg: ET.Element
) -> None:
    style = draw_run(mission.log, mission.at, TITLE).partition("</style>")[0]
    used = {css for element in svg.iter() for css in element.get("class", "").split()}
    assert {css for css in used if not re.search(rf"\.{css}\b", style)} == set()
    light, _, dark = style.partition("@media (prefers-color-scheme: dark)")
    coloured = set(re.findall(r"(\S+) \{ (?:fill|stroke): #", light))
    assert coloured == set(re.findall(r"(\S+) \{ (?:fill|stroke): #", dark))
    assert len(coloured) > 20
    log = ArenaLog(ArenaRig().arena)
    for model in ("radar", "treads"):
        log.enter(0, model, "Idle")
        log.enter(2 * SECOND, model, "Busy")
    hues = hues_of(log.stays(9 * SECOND), 9 * SECOND)
    assert len({hue for states in hues.values() for hue in states.values()}) == 4


def test_the_map_holds_the_whole_path_and_its_ticks_are_round(svg: ET.Element) -> None:
    frame = shapes(svg, "frame")[0]
    left, width = float(frame.get("x", "")), float(frame.get("width", ""))
    states = [path for path in shapes(svg, "path") if path not in key_of(svg)]
    xs = [float(x) for path in states for x in re.findall(r"[ML]([\d.]+),", path.get("d", ""))]
    assert len(states) == 5
    assert all(left < x < left + width for x in xs)
    assert len(xs) > 100
    assert Axis(-1.0, 2.0, 0.0, 300.0).ticks(60.0) == [-1.0, 0.0, 1.0, 2.0]
    assert Axis(0.0, 0.9, 0.0, 300.0).ticks(60.0) == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8])
    assert Axis(0.0, 100.0, 50.0, 550.0).ticks(60.0) == [0, 20, 40, 60, 80, 100]


def test_a_run_without_pings_and_states_or_that_ended_at_once_is_drawn_too() -> None:
    rig = ArenaRig()
    rig.drive(0, 10, 10)
    svg = ET.fromstring(draw_run(ArenaLog(rig.arena), 3 * SECOND, "drive"))  # noqa: S314
    assert len(shapes(svg, "path")) == 2
    assert len(shapes(svg, "radar-edge")) == 1
    log = ArenaLog(ArenaRig().arena)
    log.enter(0, "controller", "Idle")
    svg = ET.fromstring(draw_run(log, 0, "nothing"))  # noqa: S314
    assert "nothing" in texts(svg)
    assert len(shapes(svg, "target")) == 2


def test_the_log_gives_the_arenas_echoes_and_the_stays_between_entries() -> None:
    rig = ArenaRig(ArenaParameters(target=(0.0, 1.0)))
    log = ArenaLog(rig.arena)
    assert log.body_echoes(0) == rig.arena.body_echoes(0)
    assert log.radar_echoes(5) == rig.arena.radar_echoes(5)
    assert [ping.echo_m for ping in log.body_pings] == [pytest.approx(0.75)]
    assert [(ping.at, ping.beam) for ping in log.radar_pings] == [(5, rig.arena.radar_beam(5))]
    log.enter(0, "radar", "Idle")
    log.enter(4, "radar", "Passing")
    log.enter(4, "radar", "Turning")
    assert log.stays(9) == {"radar": [Stay("Idle", 0, 4), Stay("Turning", 4, 9)]}


def test_svg_is_written_as_it_is_and_png_by_resvg(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, object]] = []

    def svg_to_bytes(**options: object) -> list[int]:
        asked.append(options)
        return [1, 2]

    monkeypatch.setitem(sys.modules, "resvg_py", SimpleNamespace(svg_to_bytes=svg_to_bytes))
    write_picture(tmp_path / "run.svg", "<svg/>")
    assert (tmp_path / "run.svg").read_text() == "<svg/>"
    assert asked == []
    write_picture(tmp_path / "run.png", "<svg/>")
    assert (tmp_path / "run.png").read_bytes() == b"\1\2"
    assert asked == [{"svg_string": "<svg/>", "zoom": 2}]


def test_only_a_png_needs_a_renderer_which_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    require_renderer(Path("run.svg"))
    with pytest.raises(ValueError, match="expected the extra plot"):
        require_renderer(Path("run.png"))
    with pytest.raises(ValueError, match=r"-m pip install 'resvg-py>="):
        write_picture(tmp_path / "run.png", "<svg/>")
    with pytest.raises(ValueError, match=r"ends in '\.gif', expected \.svg or \.png"):
        write_picture(tmp_path / "run.gif", "<svg/>")


def test_hops_of_ten_milliseconds_share_a_colour_without_a_name() -> None:
    log = ArenaLog(ArenaRig().arena)
    log.enter(0, "controller", "Long")
    log.enter(SECOND, "controller", "Hop")
    log.enter(SECOND + 10 * MILLISECOND, "controller", "Long")
    svg = ET.fromstring(draw_run(log, 10 * SECOND, "hops"))  # noqa: S314
    assert "Hop" not in texts(svg)
    assert len([each for each in shapes(svg, "hue-brief") if each.tag.endswith("rect")]) == 1


def test_names_that_find_no_room_are_listed_in_as_many_lines_as_they_need() -> None:
    log = ArenaLog(ArenaRig().arena)
    names = [f"a state with quite a long name, number {n}" for n in range(5)]
    for number, name in enumerate(names):
        log.enter(number * SECOND, "controller", name)
    log.enter(5 * SECOND, "controller", "End")
    svg = ET.fromstring(draw_run(log, 60 * SECOND, "names"))  # noqa: S314
    lines = {text.get("y") for text in svg.iter() if text.text in names}
    assert set(names) <= set(texts(svg))
    assert len(lines) == 3
