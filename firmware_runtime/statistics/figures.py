"""The statistics of a run as one typed definition, and the JSON that `stats` prints.

Text, `top`, page, Prometheus, comparison and traces go by it. Names are the keys of the JSON.
Of a new figure there is its definition here, where it is written, and where it is shown. A counter
of a model or a line is also a field of that name in `rows`; what is computed has a line in
`statistics`.
"""

from collections.abc import Mapping
from typing import Any, Literal

from msgspec import Struct, convert, json, to_builtins
from msgspec.structs import force_setattr

from firmware_runtime.errors import Named, StatisticsFileError, in_words
from firmware_runtime.statistics.blame import Blame
from firmware_runtime.statistics.file_header import SETTINGS, Conditions
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.statistics.rows import DeadlineRow

SCHEMA = 1
_LEAST_IRREGULAR, _SHARE_IRREGULAR = 3, 10


class Activations(Struct, frozen=True):
    """Outcomes of activations; those that are waiting are scheduled and nothing else yet."""

    scheduled: int
    run: int
    skipped: int
    coalesced: int
    overruns: int
    episodes: int


class ModelFigures(Activations, frozen=True):
    """One model; its own time is `step_us`."""

    last_late_t_ns: int | None
    kind: Literal["event", "periodic"]
    period_us: float | None
    tolerance_us: float
    policy: str | None
    waiting: int
    """Due, and not had their turn yet."""
    reactions: int
    irregular: int
    """Activations of a periodic model that came at another time than its period says."""
    returned_after_us: float | None
    lateness_us: Distribution
    step_us: Distribution
    load: float | None
    """Own time by the time of the run."""

    @property
    def outstanding(self) -> int:
        """Activations that were scheduled and have no outcome."""
        return self.scheduled - self.run - self.skipped - self.coalesced

    @property
    def is_accounted_for(self) -> bool:
        """Whether those that have no outcome are those that wait."""
        return self.outstanding in {0, self.waiting}

    @property
    def keeps_period(self) -> bool:
        """True if its behaviour agrees with the period it states.

        A shift of the phase now and then contradicts none: a bring-up that was repeated, a chip
        that was silent. One in a tenth of the activations does.
        """
        seldom = self.irregular * _SHARE_IRREGULAR <= self.run
        return self.irregular < _LEAST_IRREGULAR or seldom


class ModelsByPath(Named[ModelFigures]):
    """Figures of models by their paths; another path raises UnknownName."""

    __slots__ = ()
    noun = "model"


class BusFigures(Struct, frozen=True):
    """One bus; `utilisation` is its time on the wire by the time of the run."""

    transactions: int
    bytes: int
    errors: int
    retries: int
    utilisation: float | None


class SerialFigures(Struct, frozen=True):
    """One serial port; `writing` and `reading` are the times of its bytes by that of the run."""

    writes: int
    bytes_written: int
    bytes_read: int
    errors: int
    writing: float | None
    reading: float | None


class LinkFigures(Struct, frozen=True):
    """The link to the other part of a model that runs in two processes, as this end counts it."""

    is_good: bool
    sent: int
    """Values, each once."""
    repeated: int
    """Values that were sent again, because they had not arrived."""
    received: int
    """Values that entered the model."""
    dropped: int
    """Values that arrived, and in whose place a newer one of their port was taken or which waited
    in vain for what comes before them, and datagrams that came faster than the run takes them."""
    overtaken: int
    """Values that arrived after a newer one of their port."""
    given_up: int
    """Values that left here while the other end was there, and were never sent; of an ordered port
    also those that were sent and did not arrive in time."""
    unconnected: int
    """Values that left here while no other end was there, and were never sent."""
    unsent: int
    """Datagrams for which there was no room, or no other end."""
    silences: int
    """How often the other end fell silent."""
    refused: dict[str, int]
    """Datagrams, by reason."""
    age_us: Distribution
    """Of values when they arrived, since they left their model at the other end."""
    round_trip_us: Distribution


class FaultFigures(Struct, frozen=True):
    """Faults of one kind that a model reported; `last` is the sentence of the last one."""

    count: int
    first_s: float | None
    last_s: float | None
    last: str


class Causes(Struct, frozen=True):
    """Times that an activation is made of; what is on the wire is within the models' own time."""

    wake_us: float
    behind_us: float
    garbage_us: float
    bus_us: dict[str, dict[str, float]]
    """By bus and device address."""
    models_us: dict[str, float]


class WorstActivation(Struct, frozen=True):
    """One of the activations with the largest sum of lateness and step time."""

    t_ns: int
    model: str | None
    lateness_us: float
    step_us: float
    causes: Causes
    blame: Blame | None = None
    """Why it was late; None where it was not, or where nothing of that was measured."""


class Figures(Activations, frozen=True, tag_field="schema", tag=SCHEMA):
    """All figures of a run; counts are summed and lateness is merged over its models."""

    deadline_misses: dict[str, int]
    deadlines: dict[str, DeadlineRow]
    lateness_us: Distribution
    step_us: Distribution
    """Of whole steps."""
    models: dict[str, ModelFigures]
    bus: dict[str, BusFigures]
    faults: dict[str, dict[str, FaultFigures]]
    """By model and kind; a model without faults is not there."""
    worst: list[WorstActivation]
    """The worst first."""
    conditions: Conditions
    link: LinkFigures | None = None
    """None for a run of a whole model."""
    serial: dict[str, SerialFigures] | None = None
    """By port; None for a robot without one."""
    late_by_cause: dict[str, int] | None = None
    """How many late steps each cause made; None where causes are not looked for."""

    def __post_init__(self) -> None:
        force_setattr(self, "models", ModelsByPath(self.models))

    def __repr__(self) -> str:
        run = self.conditions.run
        return (
            f"<Figures of {len(self.models)} models, {run.elapsed_s:g} s: {self.run} of "
            f"{self.scheduled} activations run, {self.overruns} late, {self.faults_total} faults>"
        )

    @property
    def is_virtual(self) -> bool:
        """True if the run was in virtual time, in which nothing can be late."""
        return self.conditions.is_virtual

    @property
    def has_begun(self) -> bool:
        """True once anything has run."""
        return self.run > 0 or self.conditions.run.steps > 0

    @property
    def on_time(self) -> float | None:
        """Share of the scheduled activations that ran without an overrun; None before the first."""
        return None if self.scheduled == 0 else (self.run - self.overruns) / self.scheduled

    @property
    def rate_hz(self) -> float | None:
        """The rate of the fastest periodic model, None if there is no such model."""
        periods = [each.period_us for each in self.models.values() if each.period_us]
        return 1e6 / min(periods) if periods else None

    @property
    def waiting(self) -> int:
        """Activations of all models that are due and have not had their turn."""
        return sum(model.waiting for model in self.models.values())

    @property
    def faults_total(self) -> int:
        """Number of faults all models have reported."""
        return sum(each.count for kinds in self.faults.values() for each in kinds.values())

    @property
    def not_keeping_period(self) -> list[str]:
        """Paths of the models that do not come back at the period that they state."""
        return [path for path, model in self.models.items() if not model.keeps_period]

    def as_json(self) -> dict[str, Any]:
        """The JSON; spelling and meaning of its keys are what other programs rely on."""
        found = {**to_builtins(self), "conditions": self.conditions.as_json()}
        absent = [
            name for name in ("link", "serial", "late_by_cause") if getattr(self, name) is None
        ]
        for name in absent:
            del found[name]
        for activation in found["worst"]:
            if activation["blame"] is None:
                del activation["blame"]
        return found


class _Printed(Struct, frozen=True):
    """Part that is read before the rest."""

    conditions: dict[str, Any]


def figures_of(printed: str | bytes, source: str) -> Figures:
    """The figures that `stats --json` printed at `source`, perhaps on another machine.

    Raises StatisticsFileError that says which key is not as expected.
    """
    try:
        return figures_from(json.decode(printed, type=dict[str, Any]))
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        raise StatisticsFileError(
            in_words(error),
            where=source,
            expected=f"what `stats --json` prints, of schema {SCHEMA}",
        ) from error


def figures_from(found: Mapping[str, Any]) -> Figures:
    """The figures of what `as_json` made. Raises msgspec's ValidationError for anything else."""
    conditions = dict(convert(found, _Printed).conditions)
    apart = {name: conditions.pop(name, {}) for name in (SETTINGS, "run")}
    return convert({**found, "conditions": {"stated": conditions, **apart}}, Figures)
