"""Healthy runs of a mission: the uses of its lines, and the envelope that a robot stays in.

The envelope is what the numbers of the world's truth were in a few healthy runs, each with another
seed of the world's noise, 0.3 s earlier or later, and a quarter of each number's own range on
either side, or as much as the rig says is no harm. Far outside is what no healthy run was near at
any instant: a whole range away.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import takewhile
from typing import Final, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.strike import Kind, Place, Strike, Use
from firmware_runtime.lab.campaign.mission import Mission, faults_of
from firmware_runtime.lab.campaign.rates import least_uses, off_pace
from firmware_runtime.lab.campaign.stated import Stated, stated_by
from firmware_runtime.lab.campaign.watched import EVERY, Look, Watched
from firmware_runtime.lab.campaign.withheld import Gaps, longest_of
from firmware_runtime.lab.campaign.wrong import Wrong, wrong_by_itself

T = TypeVar("T")
RUNS: Final = 4
_AFTER: Final = SECOND
"""How long a mission goes on beyond its end, so that what strikes at its end is watched, too,
beside the time to recover from that."""
_SLACK: Final = 300 * MILLISECOND // EVERY
_MARGIN: Final = 0.25
_FAR: Final = 4
"""So many margins are far."""
_LEAST: Final = 0.01
"""Margin of a number that never moves."""
AT_START: Final = -1
"""In place of the look before it, of a use while the robot was put together."""


class UseOfLine(Struct, frozen=True):
    """One use of a line, and the last look before the step that it is in."""

    line: str
    use: Use
    before: int


class Envelope(Struct, frozen=True):
    """Bounds of each number at each look, and at any."""

    names: tuple[str, ...]
    low: tuple[tuple[float, ...], ...]
    high: tuple[tuple[float, ...], ...]
    least: tuple[float, ...]
    most: tuple[float, ...]

    def outside(self, look: Look) -> str | None:
        """Return the name of a number that is out of its bounds at this instant."""
        number = min(look.at // EVERY, len(self.low)) - 1
        return self._outside(look, self.low[number], self.high[number]) if self.low else None

    def elsewhere(self, look: Look, since: int) -> str | None:
        """Return the name of a number that no healthy run had from an instant until now."""
        if self.outside(look) is None:
            return None
        last = min(look.at // EVERY, len(self.low)) - 1
        span = slice(max(0, min(since // EVERY - 1, last)), last + 1)
        low = [min(each) for each in zip(*self.low[span], strict=True)]
        high = [max(each) for each in zip(*self.high[span], strict=True)]
        return self._outside(look, low, high) if self.low else None

    def far_outside(self, look: Look) -> str | None:
        """Return the name of a number that no healthy run had at any instant."""
        return self._outside(look, self.least, self.most)

    def _outside(self, look: Look, low: Sequence[float], high: Sequence[float]) -> str | None:
        for name, value, least, most in zip(self.names, look.numbers, low, high, strict=True):
            if not least <= value <= most:
                return f"{name} is {value:.4g}, {least:.4g} to {most:.4g} in healthy runs"
        return None


class Healthy(Struct, frozen=True):
    """What the healthy runs of a mission were like."""

    mission: Mission
    uses: tuple[UseOfLine, ...]
    """Uses of lines within the mission, in order."""
    places: tuple[Place, ...]
    kinds: tuple[Kind, ...]
    envelope: Envelope
    looks: tuple[Look, ...]
    """Those of the run with the mission's own seed."""
    on: tuple[bool, ...]
    """Whether outputs were on, by look, in every run."""
    always_on: frozenset[str]
    """Chips that have an output on as soon as any chip has, and at each look from then on."""
    not_finite: frozenset[str]
    """Ports that send numbers that are not finite when all is well."""
    arrows: frozenset[str]
    """Arrows of all state diagrams, `MODEL: STATE -> STATE`."""
    taken: tuple[frozenset[str], ...]
    """Those that some run has taken, by look."""
    stated: Stated
    """What the rig says."""
    answers: tuple[str, ...]
    """What it can be asked."""
    within: int
    """Ns in which a fault has to be reported, or outputs off: as the mission has it, or the rig."""
    least_uses: Mapping[str, int]
    """How often each device is used in 0.3 s in which outputs are on, at the least, by its name."""
    longest_gaps: Mapping[str, int]
    """For how long each port of a device sends nothing while outputs are on, at the most, ns."""
    unready: frozenset[str]
    """Models that speak against arming when all is well."""
    until: int
    """Until when each of them goes on that does not end by itself, ns."""
    ends_at: int | None
    """When each of them has ended by itself by, ns; None where one goes on after the mission."""
    wrong: Wrong | None
    """What the oracles find without any fault; such a robot cannot be judged with one."""

    def seen_at(self, at: int) -> Look | None:
        """Return how the mission's own run stood at an instant; None after it."""
        number = at // EVERY - 1
        return self.looks[number] if number < len(self.looks) else None

    @property
    def reached(self) -> frozenset[str]:
        """Return the arrows that are taken when all is well."""
        return self.taken[-1]

    def reached_by(self, at: int) -> frozenset[str]:
        """Return those that are taken by an instant when all is well, or a while later."""
        return self.taken[min(at // EVERY - 1 + _SLACK, len(self.taken) - 1)]

    def has_been_on(self, at: int) -> bool:
        """Return whether outputs have been on by an instant when all is well."""
        return any(self.on[: at // EVERY])

    def bears_push(self, at: int) -> float | None:
        """Return the greatest push that it bears at an instant; None before outputs are first on.

        Or where its rig does not say that it bears any.
        """
        return self.stated.bears_push if self.has_been_on(at) else None

    def is_on(self, at: int) -> bool:
        """Return whether outputs are on at an instant when all is well, also a while before."""
        number = at // EVERY - 1
        return number < len(self.on) and all(self.on[max(0, number - _SLACK) : number + 1])


@lru_cache(maxsize=4)
def healthy(mission: Mission) -> Healthy:
    """Run a mission healthy, a few times. Raises ConfigError for one that fails by itself."""
    seeds = mission.seeds(RUNS)
    runs = [_Run(mission, seed) for seed in seeds]
    first = runs[0]
    if faults := [f"--without {each}" for each in faults_of(mission.without, first.places)]:
        raise ConfigError("campaign", faults)
    count = max(len(each.looks) for each in runs)
    taken = [[_at(each.taken, number) for each in runs] for number in range(count)]
    looks = [[_at(each.looks, number) for each in runs] for number in range(count)]
    return Healthy(
        mission=mission,
        uses=tuple(first.uses),
        places=first.places,
        kinds=first.kinds,
        envelope=_envelope(first.names, looks, first.stated.borne),
        looks=tuple(first.looks),
        on=tuple(all(each.is_on for each in at_once) for at_once in looks),
        always_on=frozenset.intersection(*(each.always_on for each in runs)),
        not_finite=frozenset(path for each in runs for path in each.not_finite),
        arrows=first.arrows,
        taken=tuple(frozenset().union(*at_once) for at_once in taken),
        stated=first.stated,
        answers=first.answers,
        least_uses=_least(runs),
        longest_gaps=longest_of([each.gaps.longest for each in runs]),
        unready=first.unready,
        within=first.within,
        until=first.until,
        ends_at=_last([each.ended_at for each in runs]),
        wrong=_first_wrong(runs, [None, *seeds[1:]]) or _idle(runs),
    )


class _Run:
    """One healthy run."""

    def __init__(self, mission: Mission, seed: int | None) -> None:
        self.looks: list[Look] = []
        self.taken: list[frozenset[str]] = []
        self.uses: list[UseOfLine] = []
        self.wrong: Wrong | None = None
        self.gaps = Gaps()
        self.always_on: frozenset[str] = frozenset()
        self._on_since: int | None = None
        with mission.running(seed) as robot:
            watched = Watched(robot)
            self.places = tuple(robot.session.hardware.struck.places)
            self.kinds = tuple(robot.session.hardware.struck.kinds)
            self.names = watched.asked.names
            self.answers = watched.asked.answers
            watched.asked.numbers()  # a rig whose truth is none is refused by that
            self.has_outputs = bool(watched.asked.outputs)
            self.stated = stated_by(
                watched.rig, robot.board, self.names, self.places, watched.models
            )
            within_s = mission.within_s
            self.within = seconds(self.stated.said_within_s if within_s is None else within_s)
            self._noted: dict[str, int] = {}
            self._note(watched, AT_START)
            until = seconds(mission.for_s)
            self.until = until + self.stated.recovered + _AFTER
            while watched.at < self.until and watched.outcome is None:
                before = watched.at
                self.looks.append(watched.go_on())
                self.gaps.look(self.looks[-1], watched)
                self._note_on(watched)
                watched.held_for(self.looks[-1])  # a rig that cannot say so is refused
                self.taken.append(frozenset(watched.reached))
                self.wrong = self.wrong or wrong_by_itself(watched, self.stated)
                self._note(watched, before)
            self.not_finite = watched.not_finite
            self.unready = frozenset(watched.unready())
            self.arrows = frozenset(watched.arrows)
            self.ended_at = None if watched.outcome is None else watched.at
            _check(mission, watched)
            if watched.outcome is None:
                _push(watched)
        by_line = [(each.line, each.use) for each in self.uses]
        is_on = [look.is_on for look in self.looks]
        self.least_uses = least_uses(self.places, by_line, is_on)
        self.uses = [each for each in self.uses if each.before < until]
        self.uses.sort(key=lambda each: each.use.at)
        loads = robot.board.loads.items()
        paced = {name: load for name, load in loads if name not in self.stated.unpaced}
        pace = off_pace(paced, by_line, is_on[: until // EVERY])
        if self.wrong is None and pace is not None:
            bus, what = pace
            self.wrong = Wrong("paced", bus, f"{what}, and no fault was made", until)

    def _note_on(self, watched: Watched) -> None:
        """Take down which chips are on as soon as any is, 0.3 s later at the most, and stay so."""
        if watched.outcome is not None:
            return
        on = frozenset(chip for chip, count in watched.asked.outputs.items() if count)
        if self._on_since is None and on:
            self._on_since = len(self.looks)
        if self._on_since is None:
            return
        is_begun = len(self.looks) - self._on_since >= _SLACK
        self.always_on = self.always_on & on if is_begun else self.always_on | on

    def _note(self, watched: Watched, before: int) -> None:
        """Take down the uses since the last time."""
        for name, line in watched.lines.items():
            since = self._noted.get(name, -1)
            fresh = [*takewhile(lambda use: use.at > since, line.uses())]  # noqa: B023 -- now
            self.uses += [UseOfLine(name, use, before) for use in reversed(fresh)]
            self._noted[name] = fresh[0].at if fresh else since


def _first_wrong(runs: Sequence[_Run], seeds: Sequence[int | None]) -> Wrong | None:
    """Return what is wrong in the first run that goes wrong, with its seed."""
    for run, seed in zip(runs, seeds, strict=True):
        if run.wrong is not None:
            return replace(run.wrong, seed=seed)
    return None


def _last(ends: Sequence[int | None]) -> int | None:
    """Return the last of the ends; None where a run has none."""
    found = [each for each in ends if each is not None]
    return max(found) if len(found) == len(ends) else None


def _least(runs: Sequence[_Run]) -> dict[str, int]:
    found = [each.least_uses for each in runs]
    return {name: min(each.get(name, 0) for each in found) for name in found[0]}


def _idle(runs: Sequence[_Run]) -> Wrong | None:
    """Return that a robot with outputs never drives any: nothing of it could be judged."""
    if not runs[0].has_outputs or any(look.is_on for run in runs for look in run.looks):
        return None
    return Wrong("idle", "world", "no output is ever on, and no fault was made", 0)


def _push(watched: Watched) -> None:
    """Push and hold it once, as faults do: a rig that raises then is refused."""
    struck = watched.session.hardware.struck
    for kind in struck.kinds:
        if kind.of == "world":
            struck.strike(Strike(kind.name))
    struck.clear()


def _check(mission: Mission, watched: Watched) -> None:
    """Raise ConfigError for a mission that fails without a fault."""
    outcome = watched.outcome
    if outcome is not None and outcome.error is not None:
        fault = f"it fails without any fault: {outcome.sentence}"
        raise ConfigError.of_one(mission.board, fault, "a mission that is healthy by itself")


def _at(of_run: Sequence[T], number: int) -> T:
    """What is known of a run at a look; at the last one of a run that was over by then."""
    return of_run[min(number, len(of_run) - 1)]


def _envelope(
    names: Sequence[str], looks: Sequence[Sequence[Look]], borne: Mapping[str, float]
) -> Envelope:
    columns = range(len(names))
    lows = [[min(each.numbers[c] for each in at_once) for c in columns] for at_once in looks]
    highs = [[max(each.numbers[c] for each in at_once) for c in columns] for at_once in looks]
    least = [min(low[c] for low in lows) for c in columns]
    most = [max(high[c] for high in highs) for c in columns]
    usual = [max(_MARGIN * (most[c] - least[c]), _LEAST) for c in columns]
    margins = [max(usual[c], borne.get(names[c], 0.0)) for c in columns]
    far = [max(usual[c] * _FAR, margins[c]) for c in columns]

    def window(number: int) -> slice:
        return slice(max(0, number - _SLACK), number + _SLACK + 1)

    return Envelope(
        names=tuple(names),
        low=tuple(
            tuple(min(low[c] for low in lows[window(k)]) - margins[c] for c in columns)
            for k in range(len(looks))
        ),
        high=tuple(
            tuple(max(high[c] for high in highs[window(k)]) + margins[c] for c in columns)
            for k in range(len(looks))
        ),
        least=tuple(least[c] - far[c] for c in columns),
        most=tuple(most[c] + far[c] for c in columns),
    )
