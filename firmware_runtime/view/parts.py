"""All that a page shows, as data: one schema for static pages, the live one and files of pictures.

A page is a tree of parts; each is a record whose `kind` says which. As JSON they are what the
front end (`front/`) draws, so a part says what is shown and never how. Text is text: it comes from
boards, models and reasons that are not trusted, and becomes markup nowhere.

Times over which something is drawn are s of the run, unless the axis says otherwise. A number that
was not measured is None and leaves a gap.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final, Literal, TypeAlias

from msgspec import Struct, field
from msgspec.structs import replace

from firmware_runtime.statistics.number_formats import plain
from firmware_runtime.view.thinning import thinned

Number: TypeAlias = float | int | None
Ends: TypeAlias = tuple[float, float]
Points: TypeAlias = Sequence[tuple[float, float]]
Place: TypeAlias = tuple[float, float]
Style: TypeAlias = Literal["line", "dashed", "dots", "steps", "columns"]
Judgement: TypeAlias = Literal["good", "doubtful", "bad", "open"]


class Link(Struct, frozen=True, tag="link", tag_field="kind"):
    """Words that lead to a file beside the page, or to a place on it (`#...`)."""

    text: str
    href: str


class Code(Struct, frozen=True, tag="code", tag_field="kind"):
    """Words that are typed or that a program wrote."""

    text: str


Cell: TypeAlias = str | Link | Code


class _Part(Struct, frozen=True, kw_only=True, tag_field="kind", omit_defaults=True):
    """A piece of a page."""


# Words --------------------------------------------------------------------------------------------


class Verdict(_Part, frozen=True, kw_only=True, tag="verdict"):
    """A judgement in a word, and the sentences that say why."""

    judgement: Judgement
    word: str
    sentences: Sequence[str] = ()


class Text(_Part, frozen=True, kw_only=True, tag="text"):
    """A paragraph; `look` is `quiet`, `headline` (what a program printed) or `warning`."""

    text: str
    look: Literal["", "quiet", "headline", "warning"] = ""


class Bullets(_Part, frozen=True, kw_only=True, tag="bullets"):
    """A list."""

    items: Sequence[Cell]


class Glossary(_Part, frozen=True, kw_only=True, tag="glossary"):
    """Words and what they mean."""

    items: Sequence[tuple[str, str]]


class Figures(_Part, frozen=True, kw_only=True, tag="figures"):
    """Numbers that are looked for first, by name, ready to be read."""

    items: Sequence[tuple[str, str]]


class Table(_Part, frozen=True, kw_only=True, tag="table"):
    """Rows under a head; the first cell names its row. Cells of words may break, numbers do not."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    is_words: bool = False


# Pictures -----------------------------------------------------------------------------------------


class Curve(Struct, frozen=True, omit_defaults=True):
    """Points in order of time; with style `steps` a value holds until the next.

    `colour` is a name of the palette; without one it goes by the curve's place.
    """

    name: str
    x: Sequence[Number]
    y: Sequence[Number]
    style: Style = "line"
    colour: str = ""

    @property
    def points(self) -> list[tuple[float, float]]:
        """The points that have both numbers."""
        pairs = zip(self.x, self.y, strict=True)
        return [(x, y) for x, y in pairs if x is not None and y is not None]


class Span(Struct, frozen=True, omit_defaults=True):
    """A stretch across that is shaded, with a word or two."""

    begin: float
    end: float
    name: str = ""


class Level(Struct, frozen=True, omit_defaults=True):
    """A line at a value of an axis, such as a limit or a percentile, with its words."""

    value: float
    name: str
    is_limit: bool = False


class Series(_Part, frozen=True, tag="series"):
    """Curves on common axes; plots of one page with the same `across` share cursor and zoom."""

    title: str
    across: str
    up: str
    curves: Sequence[Curve]
    spans: Sequence[Span] = ()
    levels: Sequence[Level] = ()
    """Lines across at a value."""
    across_ends: Ends | None = None
    up_ends: Ends | None = None
    """The least and greatest that an axis shows; None: what the curves have."""
    is_log: bool = False
    """Whether the vertical axis is logarithmic."""
    has_equal_scales: bool = False
    """Whether a unit is as long across as it is up, as on a map."""
    is_nested: bool = False
    """Whether each curve is thinner than the one before, so that equal ones can all be seen."""
    is_small: bool = False
    """Whether it stands beside others."""
    said: str = ""
    """What it shows, in a sentence, for those who do not see it."""
    numbers: Sequence["Table"] = ()
    """Its numbers, folded away below it."""

    @property
    def reach(self) -> tuple[Ends, Ends]:
        """Ends of its axes: across, and up."""
        points = [point for curve in self.curves for point in curve.points] or [(0.0, 0.0)]
        across = self.across_ends or _ends([x for x, _ in points])
        return across, self.up_ends or _ends([y for _, y in points])


class Histogram(_Part, frozen=True, kw_only=True, tag="histogram"):
    """Samples in bars: `edges` has one number more than `counts`. Axis `ns` is of times, in ns."""

    title: str
    across: str
    edges: Sequence[float]
    counts: Sequence[int]
    levels: Sequence[Level] = ()
    is_log: bool = False
    """Whether both axes are logarithmic."""
    is_small: bool = False
    said: str = ""
    numbers: Sequence[Table] = ()


class Piece(Struct, frozen=True, omit_defaults=True):
    """A piece of a bar, with its words."""

    name: str
    value: float
    words: str
    colour: str = ""


class Bar(Struct, frozen=True, omit_defaults=True):
    """A row of `Bars`: lanes of pieces on one scale, the second thinner. `at` is an instant, ns."""

    title: str
    lanes: Sequence[Sequence[Piece]]
    note: str = ""
    why: str = ""
    at: int | None = None


class Bars(_Part, frozen=True, kw_only=True, tag="bars"):
    """Bars made of pieces, each as wide as the page and scaled to its own sum."""

    rows: Sequence[Bar]


class Stay(Struct, frozen=True):
    """A state and how long it lasted, s."""

    state: str
    begin: float
    end: float


class Mark(Struct, frozen=True, omit_defaults=True):
    """An instant of a lane, with its words, a command that shows more, and a place on the page.

    `height` is its place in the lane, from 0 at the bottom to 1.
    """

    at: float
    words: str
    colour: str = "good"
    command: str = ""
    href: str = ""
    height: float = 0.5


class Lane(Struct, frozen=True, omit_defaults=True):
    """What one model was in, one state after the other; or what happened to it, in marks."""

    name: str
    stays: Sequence[Stay] = ()
    marks: Sequence[Mark] = ()


LANE: Final = 26
"""Pixels of a lane of states."""


class Lanes(_Part, frozen=True, kw_only=True, tag="lanes"):
    """States or marks over time, a lane a model; it shares the cursor of plots of its `across`."""

    title: str
    lanes: Sequence[Lane]
    across: str = "s"
    ends: Ends | None = None
    height: int = LANE
    """Pixels of a lane."""
    colours: Mapping[str, str] = {}
    """Colours of marks by what they mean."""

    @property
    def reach(self) -> Ends:
        """Its first and last instant."""
        stays = [stay.end for lane in self.lanes for stay in lane.stays]
        marks = [mark.at for lane in self.lanes for mark in lane.marks]
        return self.ends or (0.0, max([*stays, *marks], default=1.0) or 1.0)

    @property
    def lasted(self) -> dict[str, float]:
        """How long each state lasted, the longest first; the n-th has the n-th colour."""
        found: dict[str, float] = {}
        for stay in (stay for lane in self.lanes for stay in lane.stays):
            found[stay.state] = found.get(stay.state, 0.0) + stay.end - stay.begin
        return dict(sorted(found.items(), key=lambda each: -each[1]))


class Shape(Struct, frozen=True, omit_defaults=True):
    """A figure on a plane, in its unit.

    `form` is `circle` (centre, radius), `polygon`, `line` (points), or `sector` (apex, radius,
    direction and half its angle, rad). `look` is one of LOOKS.
    """

    form: Literal["circle", "polygon", "line", "sector"]
    points: Sequence[Place]
    radius: float = 0.0
    direction_rad: float = 0.0
    half_rad: float = 0.0
    look: str = "thing"
    name: str = ""
    colour: str = ""


MOST_POINTS: Final = 4000
"""Points of a curve on a page, unless it says otherwise."""
LOOKS: Final = ("thing", "low", "target", "goal", "body", "ghost", "nose", "path", "ray", "echo")
"""What a shape is: an obstacle, a low one, the goal and the ring round it, the robot, where it was,
its front, its way, a ray that met nothing, one that met something."""


class Bound(Struct, frozen=True, omit_defaults=True):
    """A number of a moving body: a port of the model below its root, and a field of its value.

    The number drawn is `scale` times it, and `offset`. Where the port has no value, as that of a
    world's probe on the robot itself, it is that of `otherwise`, such as the robot's own estimate.
    """

    port: str
    field: str = ""
    scale: float = 1.0
    offset: float = 0.0
    otherwise: "Bound | None" = None


class Arrow(Struct, frozen=True, omit_defaults=True):
    """A force or a speed on a body: from a place on it, in a direction of its own, so long."""

    at: Place
    direction_rad: float
    length: Bound
    name: str = ""


class Ray(Struct, frozen=True, omit_defaults=True):
    """A sensor's beam: from a place on its body, as far as a port says, `reach` at most."""

    at: Place
    half_rad: float
    reach: float
    length: Bound | None = None
    direction_rad: Bound | None = None
    name: str = ""


class Body(Struct, frozen=True, omit_defaults=True):
    """A figure that moves: its shapes in its own frame, and the ports that say where it is.

    What is not bound stays at 0. `trail` draws the way that it came.
    """

    name: str
    shapes: Sequence[Shape]
    x: Bound | None = None
    y: Bound | None = None
    heading_rad: Bound | None = None
    arrows: Sequence[Arrow] = ()
    rays: Sequence[Ray] = ()
    has_trail: bool = False


class Plane(_Part, frozen=True, kw_only=True, tag="plane"):
    """The world from above: what stands, and bodies that move as the values of ports say."""

    title: str
    shapes: Sequence[Shape] = ()
    bodies: Sequence[Body] = ()
    unit: str = "m"
    across_ends: Ends | None = None
    up_ends: Ends | None = None


class Diagram(_Part, frozen=True, kw_only=True, tag="diagram"):
    """A drawn model: the text of an SVG file whose boxes and wires name their models and ports."""

    title: str
    svg: str


# Order --------------------------------------------------------------------------------------------


class Section(_Part, frozen=True, kw_only=True, tag="section"):
    """Parts under a heading."""

    title: str
    parts: Sequence["Part"]


class Folded(_Part, frozen=True, kw_only=True, tag="folded"):
    """Parts that are hidden until the summary is clicked."""

    title: str
    parts: Sequence["Part"]


class Beside(_Part, frozen=True, kw_only=True, tag="beside"):
    """Parts beside each other where the page is wide enough."""

    parts: Sequence["Part"]


class Card(_Part, frozen=True, kw_only=True, tag="card"):
    """Parts of one thing among several, under its name."""

    title: Cell
    parts: Sequence["Part"]
    note: str = ""


Part: TypeAlias = (
    Verdict
    | Text
    | Bullets
    | Glossary
    | Figures
    | Table
    | Series
    | Histogram
    | Bars
    | Lanes
    | Plane
    | Diagram
    | Section
    | Folded
    | Beside
    | Card
)


class Page(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A page: its title, what is to be read first, and the rest."""

    title: str
    opening: Sequence["Part"] = ()
    parts: Sequence["Part"] = field(default_factory=list)


# The usual ones, in a line ------------------------------------------------------------------------


def section(title: str, *parts: Part | None) -> Section:
    """Parts under a heading; None are left out."""
    return Section(title=title, parts=[each for each in parts if each is not None])


def table(
    title: str, head: Sequence[str], rows: Iterable[Sequence[Cell]], *, is_words: bool = False
) -> Table:
    """A table of all these rows."""
    return Table(title=title, head=head, rows=[list(row) for row in rows], is_words=is_words)


def all_parts(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield these parts, and those that they hold."""
    for part in parts:
        yield part
        yield from all_parts(getattr(part, "parts", ()))


def facts(title: str, values: Mapping[str, object]) -> Table:
    """A table of values by name, in words."""
    rows = [(name.replace("_", " "), plain(value)) for name, value in values.items()]
    return table(title, ("what", "value"), rows, is_words=True)


def curve(
    name: str, points: Points, style: Style = "line", colour: str = "", most: int = MOST_POINTS
) -> Curve:
    """A curve through points, in order of the first number; of too many the ends of pieces."""
    xs, ys = zip(*points, strict=True) if points else ((), ())
    x, y = thinned(xs, ys, most)
    return Curve(name, list(x), list(y), style, colour)


def on_common_axes(plots: Mapping[str, Series]) -> dict[str, Series]:
    """The plots with one axis for each quantity: equal labels, equal ends."""
    across: dict[str, Ends] = {}
    up: dict[str, Ends] = {}
    for plot in plots.values():
        for label, ends, found in zip(
            (plot.across, plot.up), plot.reach, (across, up), strict=True
        ):
            low, high = found.get(label, ends)
            found[label] = min(low, ends[0]), max(high, ends[1])
    return {
        name: replace(plot, across_ends=across[plot.across], up_ends=up[plot.up])
        for name, plot in plots.items()
    }


def _ends(values: Sequence[float]) -> Ends:
    """The least and greatest, apart."""
    low, high = min(values), max(values)
    room = 0.04 * (high - low) or max(abs(low), 1.0) * 0.5
    return (low - room if low < 0 or low > room else min(low, 0.0)), high + room
