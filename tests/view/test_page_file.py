"""A page as a file: each kind of part as a picture, and what is said where none can be drawn."""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.view.page_file import page_file_faults, read_page, write_page
from firmware_runtime.view.parts import (
    Bar,
    Bars,
    Curve,
    Histogram,
    Lane,
    Lanes,
    Level,
    Mark,
    Page,
    Part,
    Piece,
    Plane,
    Series,
    Shape,
    Span,
    Stay,
    Text,
    curve,
    section,
)

WAY = [(0.0, 0.0), (1.0, 2.0), (2.0, 1.0)]
KINDS: dict[str, tuple[Part, set[str]]] = {
    "curves": (
        Series(
            "curves",
            "s",
            "rad",
            [
                curve("way", WAY),
                curve("_reference", WAY, "dashed"),
                curve("held", WAY, "steps"),
                curve("pings", WAY, "dots"),
            ],
            spans=[Span(0.5, 1.5, "stuck")],
            levels=[Level(1.5, "limit", is_limit=True)],
        ),
        {"way", "_reference", "held", "pings", "stuck", "limit", "rad", "s"},
    ),
    "counts": (
        Series("counts", "s", "n", [Curve("late", [0, 1, 2], [1, None, 3], "columns")]),
        {"n"},
    ),
    "times": (
        Series("times", "s", "ns", [curve("c", [(0, 2e3), (1, 5e7)], "steps")], is_log=True),
        {"10 µs", "1 ms"},
    ),
    "path": (
        Series("path", "x, m", "y, m", [curve("c", WAY)], has_equal_scales=True),
        {"x, m", "y, m"},
    ),
    "nothing": (Series("nothing", "s", "m", [curve("none", [])]), {"m"}),
    "bars": (
        Histogram(
            title="bars",
            across="ns",
            edges=[1000, 2000, 4000],
            counts=[3, 100],
            levels=[Level(1500, "p50")],
            is_log=True,
        ),
        {"p50", "100"},
    ),
    "states": (
        Lanes(
            title="states",
            lanes=[Lane("radar", [Stay("Idle", 0, 5), Stay("Brief", 5, 5.1)]), Lane("arm", [])],
        ),
        {"radar", "arm", "Idle", "Brief"},
    ),
    "marks": (
        Lanes(
            title="marks",
            lanes=[Lane("imu", marks=[Mark(1.0, "froze", "bad", "rerun 1", "#x", 0.2)])],
            height=50,
            colours={"found": "bad"},
        ),
        {"imu", "found"},
    ),
    "map": (
        Plane(
            title="map",
            shapes=[
                Shape("circle", [(0, 1)], 0.1, look="target", name="target"),
                Shape("circle", [(0, 1)], 0.5, look="goal", name="goal"),
                Shape("line", [(-1, -1), (2, -1)], name="wall"),
                Shape("sector", [(0, 0)], 1.2, 1.0, 0.3, "echo", "echo"),
                Shape("polygon", [(0, 0), (0.2, 0.1), (0.2, -0.1)], look="body", name="robot"),
            ],
        ),
        {"target", "goal", "wall", "echo", "robot", "x, m"},
    ),
}


def page_of(*parts: Part) -> Page:
    return Page(title="A $x_1$ <run>", opening=[Text(text="It found it.")], parts=parts)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_drawn_with_its_words_as_text(tmp_path: Path, kind: str) -> None:
    part, words = KINDS[kind]
    write_page(page_of(section("in a section", part)), tmp_path / "one.svg")
    write_page(page_of(part), tmp_path / "other.svg")
    drawn = ET.fromstring((tmp_path / "one.svg").read_text())  # noqa: S314 -- our own
    found = {(each.text or "").strip() for each in drawn.iter() if each.tag.endswith("}text")}
    assert {kind, "A $x_1$ <run>", "It found it.", *words} <= found
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "other.svg").read_bytes()


@pytest.mark.slow
def test_all_of_them_are_one_png_and_what_is_no_picture_is_left_out(tmp_path: Path) -> None:
    bars = Bars(rows=[Bar("step", [[Piece("imu", 1.0, "1 us")]])])
    write_page(page_of(bars, *(part for part, _ in KINDS.values())), tmp_path / "all.png")
    assert (tmp_path / "all.png").read_bytes().startswith(b"\x89PNG")


def test_a_page_without_pictures_is_its_title(tmp_path: Path) -> None:
    write_page(page_of(Text(text="No number differs.")), tmp_path / "none.svg")
    assert "A $x_1$ &lt;run&gt;" in (tmp_path / "none.svg").read_text()


def test_a_page_and_its_data_need_no_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    page = page_of(KINDS["curves"][0])
    for name in ("run.html", "run.json"):
        assert page_file_faults(tmp_path / name) == []
        write_page(page, tmp_path / name)
    assert read_page(tmp_path / "run.json").parts == [page.parts[0]]
    assert "It found it." in (tmp_path / "run.html").read_text()


def test_without_the_extra_it_is_said_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    (fault,) = page_file_faults(tmp_path / "run.svg")
    assert re.search(r"expected the extra plot: \S+ -m pip install 'matplotlib>=", fault)
    monkeypatch.delitem(sys.modules, "firmware_runtime.view.picture_file", raising=False)
    with pytest.raises(ConfigError, match="expected the extra plot"):
        write_page(page_of(), tmp_path / "run.svg")
    assert list(tmp_path.iterdir()) == []


def test_another_ending_is_refused(tmp_path: Path) -> None:
    (fault,) = page_file_faults(tmp_path / "run.gif")
    assert fault.endswith("ends in '.gif', expected .svg, .png, .html or .json")


@pytest.mark.parametrize("content", ["", "{}", '{"title": 3}', "[]"])
def test_what_is_no_page_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "run.json").write_text(content)
    with pytest.raises(ConfigError, match="expected a page's data"):
        read_page(tmp_path / "run.json")


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--plot"):
        write_page(page_of(), tmp_path / "nowhere" / "run.html", "--plot")
