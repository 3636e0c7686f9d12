"""Parts keep what they are given, and are the same again when they were data."""

from collections.abc import Sequence

import msgspec

from firmware_runtime.view.parts import (
    Card,
    Code,
    Folded,
    Lane,
    Lanes,
    Link,
    Page,
    Plane,
    Series,
    Shape,
    Stay,
    Text,
    all_parts,
    curve,
    on_common_axes,
    section,
    table,
)


def plot(title: str, up: str, *values: float) -> Series:
    return Series(title, "s", up, [curve("value", list(enumerate(values)))])


def test_plots_of_one_quantity_have_one_axis() -> None:
    plots = {
        "low": plot("low", "rad", 0.0, 1.0),
        "high": plot("high", "rad", 3.0, 5.0, 4.0),
        "other": plot("other", "N", -100.0, 100.0),
    }
    common = on_common_axes(plots)
    assert common["low"].reach == common["high"].reach
    assert common["low"].reach[1][0] <= 0.0
    assert common["low"].reach[1][1] >= 5.0
    assert common["other"].reach[0] == common["low"].reach[0]
    assert common["other"].reach[1] == plots["other"].reach[1]


def test_a_single_peak_among_many_points_is_kept() -> None:
    points = [(float(n), 7.0 if n == 12_345 else 0.0) for n in range(20_000)]
    kept = curve("x", points).points
    assert len(kept) <= 4000
    assert (12_345.0, 7.0) in kept
    assert kept == sorted(kept)
    assert curve("x", points[:4000]).points == points[:4000]


def test_what_was_not_measured_is_no_point() -> None:
    assert curve("c", [(0.0, 1.0)]).points == [(0.0, 1.0)]
    assert curve("c", []).points == []


def test_a_page_is_the_same_again_when_it_was_data() -> None:
    shown: Sequence[object] = [
        Text(text="words"),
        table("t", ("a", "b"), [("x", Link("y", "y.csv")), ("z", Code("run"))]),
        plot("p", "m", 1.0, 2.0),
        Lanes(title="states", lanes=[Lane("model", [Stay("idle", 0.0, 1.0)])]),
        Plane(title="map", shapes=[Shape("circle", [(1.0, 2.0)], 0.5, name="target")]),
    ]
    page = Page(title="page", parts=[Folded(title="more", parts=[section("s", *shown)])])  # type: ignore[arg-type]
    data = msgspec.json.encode(page)
    again = msgspec.json.decode(data, type=Page)
    assert msgspec.json.encode(again) == data
    assert [type(each) for each in all_parts(again.parts)][2:] == [type(each) for each in shown]


def test_parts_within_parts_are_found_in_order() -> None:
    inner = Card(title="card", parts=[Text(text="a"), Text(text="b")])
    found = all_parts([section("s", inner), Text(text="c")])
    assert [each.text for each in found if isinstance(each, Text)] == ["a", "b", "c"]
