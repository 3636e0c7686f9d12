"""Findings of a campaign: equal ones are one, made as short as they get, and saved.

Equal are those of one oracle, model and kind of fault; a pair, one of whose faults alone shows the
same, is equal to that. The shortest and latest of them is tried shorter still, and with fewer
settings; what is left is one line of fault script.
"""

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board import installed
from firmware_runtime.board.assignments import assigned
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.strike import KINDS, Strike
from firmware_runtime.lab.campaign.asked import Oracle
from firmware_runtime.lab.campaign.fork import in_child
from firmware_runtime.lab.campaign.mission import Mission
from firmware_runtime.lab.campaign.trial import LOST, Trial, alone, trial_of
from firmware_runtime.lab.campaign.verdict import SOUND
from firmware_runtime.lab.campaign.without_faults import wrong_without_faults
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.runs.fault_test import FaultTest, quoted, set_source, sources_of
from firmware_runtime.system.atomic_file import keep_output

SHORTER_S: Final = (0.0, 0.05, 0.2, 1.0)
"""Lengths that a fault is tried with, s; 0 is once."""
_WORDS: Final = 32
"""Words that a sensor measures, or outputs of a chip, at most."""
Group: TypeAlias = tuple[str, str, str]
"""Oracle, model and kinds of a finding: what equal ones have in common."""
Shortening: TypeAlias = Callable[[int, int], None]
"""Called with the number of a finding that is made shorter now, the first is 1, and of how many."""
_OWN: Final = "own"
_ORACLE: Final = (
    "def judge(rig: object) -> str | None:",
    '    raise NotImplementedError("put the oracle here that the campaign was given")',
    "",
)
"""Lines of a test whose finding shows only to an oracle that the campaign was given."""


class Finding(Struct, frozen=True, kw_only=True):
    """What breaks a robot, in at most three lines."""

    oracle: str
    model: str
    kind: str
    what: str
    """A sentence about what goes wrong."""
    at_s: float
    """When it is known, s of the run."""
    faults: tuple[Strike, ...]
    """The script that shows it."""
    mission: Mission
    """Where it shows: its settings are those that it takes."""
    row: int
    """A row of the table that has it."""
    count: int
    """Rows that have it."""
    goes_on: bool = False
    """Whether its run goes on to the end of its mission, and shows it only then."""
    is_flaky: bool = False
    """Whether it was another one when it was run again."""
    needs_oracle: bool = False
    """Whether an oracle of a test's own has found it: without that one it shows in nothing."""
    said: str | None = None
    """What was reported first, `MODEL: KIND`; None for nothing."""
    said_after_s: float | None = None
    """How long after its fault began."""
    recording: str | None = None
    test: str | None = None

    @property
    def trial(self) -> Trial:
        """The run that shows it."""
        return Trial(self.mission, self.faults, goes_on=self.goes_on)

    @property
    def group(self) -> Group:
        """What equal findings have in common."""
        return self.oracle, self.model, self.kind

    @property
    def lines(self) -> list[str]:
        """It in words: what, by which fault, and where it is kept."""
        alike = "" if self.count == 1 else f" ({self.count} runs alike)"
        script = ", ".join(sources_of(self.faults)) or "no fault"
        chosen = " ".join(["on", *self.mission.words])
        row = f"row {self.row}" if self.faults else "no row"
        kept = f"kept as {self.test}" if self.test else row
        known = [f"known at {self.at_s:g} s"]
        if self.at_s > self.mission.for_s and not self.faults:
            known.append("after its mission")
        if self.said is not None:
            known.append(f"{self.said} reported after {self.said_after_s:.3g} s")
        if self.is_flaky:
            known.append("another one each time")
        return [
            f"{self.oracle} of {self.model}: {self.what}{alike}",
            f"  {script} {chosen}{', to the end of its mission' * self.goes_on}",
            f"  {', '.join(known)}; {kept}",
        ]

    def as_json(self) -> dict[str, object]:
        """Return it as the command prints it."""
        return {
            "oracle": self.oracle,
            "model": self.model,
            "kind": self.kind,
            "what": self.what,
            "at_s": self.at_s,
            "said": self.said,
            "said_after_s": self.said_after_s,
            "faults": sources_of(self.faults),
            "goes_on": self.goes_on,
            "set": list(self.mission.assignments),
            "row": self.row,
            "count": self.count,
            "is_flaky": self.is_flaky,
            "recording": self.recording,
            "test": self.test,
        }


def group_in(found: Collection[Group], row: Row) -> Group:
    """Return which of the findings a row has; its own group where none is.

    A pair has that of one of its faults alone.
    """
    oracle, model, trial = str(row["outcome"]), str(row["model"]), trial_of(row)
    each_alone = (
        (oracle, of, strike.kind) for strike in trial.strikes for of in (model, strike.device)
    )
    return next((each for each in each_alone if each in found), (oracle, model, trial.kinds))


def is_wrong(row: Row) -> bool:
    """Return whether a row has a finding."""
    return row["outcome"] not in {SOUND, LOST}


def findings_of(
    rows: Sequence[Row],
    folder: Path | None,
    oracle: Oracle | None = None,
    shortening: Shortening | None = None,
) -> list[Finding]:
    """Find what is wrong in rows, shorten it, and save it in a folder if one is given."""
    found: dict[Group, Finding] = {}
    groups = _alike(rows).values()
    for number, alike in enumerate(groups, 1):
        if shortening is not None:
            shortening(number, len(groups))
        same = group_in(found, alike[0])
        if same not in found:
            finding = _shortened(alike, oracle)
            same = finding.group
        if same in found:
            found[same] = replace(found[same], count=found[same].count + len(alike))
            continue
        names = {each.test for each in found.values()}
        found[same] = finding if folder is None else _saved(finding, folder, oracle, names)
    return list(found.values())


def finding_without_faults(
    mission: Mission, folder: Path | None, oracle: Oracle | None = None
) -> Finding | None:
    """Return what is wrong with a mission that no fault strikes, saved if a folder is given."""
    wrong = wrong_without_faults(mission, oracle)
    if wrong is None:
        return None
    needs_oracle = oracle is not None and wrong.oracle == _OWN
    if wrong.seed is not None:
        mission = replace(mission, seed=wrong.seed)
    if wrong.setting is not None:
        mission = replace(mission, assignments=(*mission.assignments, wrong.setting))
    finding = Finding(
        oracle=wrong.oracle,
        model=wrong.model,
        kind="none",
        what=wrong.what,
        at_s=wrong.at / SECOND,
        faults=(),
        mission=mission,
        row=0,
        count=1,
        needs_oracle=needs_oracle and wrong_without_faults(mission) is None,
    )
    return finding if folder is None else _with_test(finding, folder, set())


def as_in_rows(rows: Sequence[Row]) -> list[Finding]:
    """Return what is wrong in rows as it stands there, the shortest and latest of equal ones."""
    return [
        _finding(first, trial_of(first), first, len(alike))
        for alike in _alike(rows).values()
        for first in [min(alike, key=_length)]
    ]


def is_same(row: Row, again: Row) -> bool:
    """Return whether two runs of a row came to the same, to the bit."""
    return (row["outcome"], row["digest"]) == (again["outcome"], again["digest"])


def _alike(rows: Sequence[Row]) -> Mapping[Group, list[Row]]:
    found: dict[Group, list[Row]] = {}
    for row in filter(is_wrong, rows):  # pairs come last
        found.setdefault(group_in(found, row), []).append(row)
    return found


def _shortened(alike: list[Row], oracle: Oracle | None) -> Finding:
    first = min(alike, key=_length)
    trial, shown = trial_of(first), first
    is_flaky = not is_same(first, alone(trial, oracle=oracle))
    for shorter in [] if is_flaky else (*_fewer(trial), *_shorter(trial)):
        row = alone(shorter, oracle=oracle)
        models = first["model"], *(each.device for each in shorter.strikes)
        if row["outcome"] == first["outcome"] and row["model"] in models:
            trial, shown = shorter, row
            break
    for each in [] if is_flaky else trial.mission.assignments:
        fewer = replace(
            trial.mission, assignments=tuple(a for a in trial.mission.assignments if a != each)
        )
        try:
            row = alone(replace(trial, mission=fewer), oracle=oracle)
        except ConfigError:  # no board without this setting
            continue
        if group_in((), row) == group_in((), first):
            trial, shown = replace(trial, mission=fewer), row
    for smaller in [] if is_flaky else _smaller(trial):
        if is_same(row := alone(smaller, oracle=oracle), shown):
            trial, shown = smaller, row
            break
    finding = _finding(first, trial, shown, len(alike))
    needs_oracle = oracle is not None and finding.oracle == _OWN and not is_wrong(alone(trial))
    return replace(finding, is_flaky=is_flaky, needs_oracle=needs_oracle)


def _finding(first: Row, trial: Trial, shown: Row, count: int) -> Finding:
    """Return the finding of a row, as it shows in another, or in itself."""
    number = first["row"]
    return Finding(
        oracle=str(shown["outcome"]),
        model=str(shown["model"]),
        kind=trial.kinds,
        what=str(shown["what"]),
        at_s=float(shown["known_at_s"] or 0.0),
        said=None if shown["said"] is None else str(shown["said"]),
        said_after_s=None if shown["said_after_s"] is None else float(shown["said_after_s"]),
        faults=trial.strikes,
        mission=trial.mission,
        row=number if isinstance(number, int) else 0,
        count=count,
        goes_on=trial.goes_on,
    )


def _length(row: Row) -> tuple[int, int, float]:
    """Order rows: one fault before two, then the shorter, then the later."""
    strikes = trial_of(row).strikes
    return len(strikes), max(each.span for each in strikes), -strikes[0].at_s


def _fewer(trial: Trial) -> Iterator[Trial]:
    """Yield the trial with one of its faults alone, the first or the last, then with more."""
    strikes = trial.strikes
    if len(strikes) > 1:
        yield from (replace(trial, strikes=(each,)) for each in (strikes[0], strikes[-1]))
    for count in range(3, len(strikes)):
        yield replace(trial, strikes=strikes[:count])


def _shorter(trial: Trial) -> Iterator[Trial]:
    """Yield the trial with shorter faults, the shortest first, and those that do not go on."""
    for goes_on in sorted({False, trial.goes_on}):
        for for_s in (*SHORTER_S, None):
            strikes = tuple(_for_at_most(each, for_s) for each in trial.strikes)
            shorter = replace(trial, strikes=strikes, goes_on=goes_on)
            if shorter != trial:
                yield shorter


def _smaller(trial: Trial) -> Iterator[Trial]:
    """Yield the trial with the first of the words or outputs that the number of its fault may be.

    A space counts them round, by large numbers.
    """
    kinds = [KINDS[each.kind] for each in trial.strikes]
    if all(kind.is_numbered and kind.of in {"sensor", "actuator"} for kind in kinds):
        first = trial.strikes[0].extent or 0.0
        for number in range(min(_WORDS, int(first))):
            strikes = tuple(replace(each, amount=float(number)) for each in trial.strikes)
            yield replace(trial, strikes=strikes)


def _for_at_most(strike: Strike, for_s: float | None) -> Strike:
    """Return a fault that lasts so long at most, where its kind can; None is as it is."""
    if for_s is None:
        return strike
    shorter = replace(strike, for_s=for_s)
    is_one = shorter.fault() is None and shorter.span < strike.span
    return shorter if is_one and not KINDS[strike.kind].is_moment else strike


def _saved(
    finding: Finding, folder: Path, oracle: Oracle | None, names: set[str | None]
) -> Finding:
    """Keep its recording, and the test."""
    finding = _with_test(finding, folder, names)
    recording = Path(str(finding.test)).with_suffix(".recording")
    alone(finding.trial, oracle=oracle, record=recording)
    is_kept = recording.exists()
    replays = in_child(lambda: {"same": _replays(recording)}) if is_kept else {"same": True}
    is_flaky = finding.is_flaky or replays != {"same": True}
    return replace(finding, is_flaky=is_flaky, recording=str(recording) if is_kept else None)


def make_folder(folder: Path) -> None:
    """Make the folder of findings, if it is not there. Raises ConfigError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fault = f"{folder}: {error.strerror}; expected a folder that can be written"
        raise ConfigError.of_one("--findings", fault) from error


def _with_test(finding: Finding, folder: Path, names: set[str | None]) -> Finding:
    """Write the test of a finding, under a name that is not among `names`."""
    words = [Path(finding.mission.board).stem, finding.oracle, finding.model, finding.kind]
    name = re.sub(r"\W+", "_", "_".join(words).lower()).strip("_")
    test = folder / f"test_{name}.py"
    number = 2
    while str(test) in names:
        test, number = folder / f"test_{name}_{number}.py", number + 1
    keep_output(test, text_of_test(finding, test.stem).encode(), "--findings")
    return replace(finding, test=str(test))


def _replays(recording: Path) -> bool:
    # of findings only
    from firmware_runtime.recording.replay.replay_assertion import difference_of  # noqa: PLC0415

    first, _ = difference_of(recording)
    return first is None


def text_of_test(finding: Finding, name: str) -> str:
    """Return the source of a test that fails until the finding is fixed."""
    mission = finding.mission
    chosen = f", for_s={mission.for_s!r}{set_source(dict(map(assigned, mission.assignments)))}"
    if mission.seed is not None:
        chosen += f", seed={mission.seed!r}"
    if mission.within_s is not None:
        chosen += f", within_s={mission.within_s!r}"
    chosen += ", goes_on=True" * finding.goes_on
    chosen += ", judge=judge" * finding.needs_oracle
    test = FaultTest(
        name=name,
        title=f"{Path(mission.board).name}: {finding.oracle} of {finding.model}.",
        about=f"Found by `firmware-runtime campaign`: {finding.what}.",
        imported="from firmware_runtime import Strike\n"
        "from firmware_runtime.lab.campaign import assert_sound",
        faults=finding.faults,
        body=[
            *(_ORACLE if finding.needs_oracle else ()),
            f"assert_sound({quoted(_anywhere(mission.board))}, FAULTS{chosen})",
        ],
    )
    return test.text()


def _anywhere(board: str) -> str:
    """Return a board as it is found in any folder: its name, or the whole path of its file."""
    return board if board in installed.names() else str(Path(board).absolute())
