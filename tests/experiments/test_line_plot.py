"""A plot keeps what it is given: its axes, its peaks, and what is shaded."""

from xml.etree.ElementTree import Element

import pytest

from firmware_runtime.view.line_plot import Curve, LinePlot, Span, on_common_axes


def polyline(plot: LinePlot, number: int = 0) -> Element:
    return plot.svg().findall("polyline")[number]


def heights(plot: LinePlot) -> list[float]:
    """Of the points of the first curve, pixels from the top."""
    return [float(each.split(",")[1]) for each in (polyline(plot).get("points") or "").split()]


def plot(title: str, up: str, *values: float) -> LinePlot:
    return LinePlot(title, "s", up, [Curve("value", [(float(n), v) for n, v in enumerate(values)])])


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
    assert heights(common["low"])[1] > heights(common["high"])[0]


def test_a_single_peak_among_many_points_is_drawn() -> None:
    values = [0.0] * 20_000
    values[12_345] = 7.0
    drawn = heights(plot("peak", "ms", *values))
    assert len(drawn) < 5000
    assert min(drawn) == pytest.approx(min(heights(plot("whole", "ms", 0.0, 7.0, 0.0))), abs=0.2)


def test_a_span_is_cut_off_where_the_axis_ends() -> None:
    shaded = LinePlot("t", "s", "m", [Curve("c", [(0.0, 0.0), (10.0, 1.0)])], [Span(8, 30, "late")])
    plain = LinePlot("t", "s", "m", [Curve("c", [(0.0, 0.0), (10.0, 1.0)])])
    span = next(each for each in shaded.svg().iter("rect") if each.get("class") == "lp-span")
    end = float(span.get("x") or 0) + float(span.get("width") or 0)
    assert end <= shaded.width
    assert not [each for each in plain.svg().iter("rect") if each.get("class") == "lp-span"]
    assert "late" in shaded.text()


def test_nested_curves_grow_thinner_and_the_reference_stays_as_it_is() -> None:
    points = [(0.0, 0.0), (1.0, 1.0)]
    curves = [
        Curve("first", points),
        Curve("second", points),
        Curve("third", points, is_dashed=True),
    ]
    nested = LinePlot("t", "s", "m", curves, is_nested=True)
    first, second, third = (polyline(nested, number).get("stroke-width") for number in range(3))
    assert float(first or 0) > float(second or 0)
    assert third is None


def test_a_plot_of_nothing_is_drawn() -> None:
    assert "<svg" in LinePlot("empty", "s", "m", [Curve("none", [])]).text()


def test_a_map_has_equal_scales() -> None:
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    drawn = polyline(LinePlot("t", "m", "m", [Curve("c", square)], has_equal_scales=True))
    places = [tuple(map(float, each.split(","))) for each in (drawn.get("points") or "").split()]
    assert places[1][0] - places[0][0] == pytest.approx(places[1][1] - places[2][1], abs=0.2)


@pytest.mark.parametrize(
    "up", ["rad", "0 stop, 1 clockwise, 2 counterclockwise, 3 anything else there is"]
)
@pytest.mark.parametrize("names", [2, 5, 12])
def test_a_legend_keeps_within_the_picture_and_off_the_label_and_the_curves(
    up: str, names: int
) -> None:
    curves = [
        Curve(f"a curve with number {each}", [(0.0, 0.0), (1.0, 1.0)]) for each in range(names)
    ]
    drawn = LinePlot("t", "s", up, curves, width=600.0)
    texts = list(drawn.svg().iter("text"))
    label = next(each for each in texts if each.text == up)
    named = [each for each in texts if each.get("class") == "lp-name"]
    assert len(named) == names
    places = [(float(each.get("x") or 0) - 22, float(each.get("y") or 0)) for each in named]
    end_of_label = 4 + 7 * len(up)
    assert all(x >= 0 for x, _ in places)
    assert all(y > float(label.get("y") or 0) + 8 or x > end_of_label for x, y in places)
    assert min(heights(drawn)) > max(y for _, y in places)
    assert len(set(places)) == names
