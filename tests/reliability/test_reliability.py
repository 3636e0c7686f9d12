"""A sample of each part of `make campaign`, and that its document says what was measured."""

import math
import random
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.board.local_settings import board_in_force
from tests.reliability import (
    campaigns,
    document,
    dying,
    fuzzing,
    machines,
    networks,
    planted,
    soak,
)
from tests.reliability.changed_lines import changed_lines, read_diff
from tests.reliability.fuzz_seeds import seeds
from tests.reliability.fuzz_targets import TARGETS, built
from tests.reliability.mutations import mutants_of
from tests.reliability.results import KEPT, ROOT, Result, keep, read_kept, summed

SOURCE = '''
"""A module."""
Word: TypeAlias = int | str
LIMIT: int = 3
def late(lag: int, *, limit: int = LIMIT) -> bool:
    """Say whether it is late."""
    if lag < 0 or lag % 2:
        raise ValueError(f"{lag + 1}")
    note(lag)
    return lag >= limit
'''


def test_a_mutant_is_one_change_of_code_and_none_of_words() -> None:
    mutants = [*mutants_of("x.py", SOURCE)]
    changes = {(each.before, each.text) for each in mutants}
    assert changes == {
        ("3", "4"),
        ("lag < 0 or lag % 2", "(lag < 0 and lag % 2)"),
        ("lag < 0", "(lag <= 0)"),
        ("0", "1"),
        ("lag % 2", "(lag // 2)"),
        ("2", "3"),
        ("note(lag)", "pass"),
        ("lag >= limit", "(lag > limit)"),
    }
    for each in mutants:
        changed = each.applied(SOURCE)
        assert changed != SOURCE
        compile(changed, "x.py", "exec")


def test_a_mutant_keeps_its_name_where_lines_come_and_go() -> None:
    source = "def late() -> bool:\n    return seen(0) and seen(0)\n"
    names = [str(each) for each in mutants_of("x.py", source)]
    assert names == [
        "x.py:late: seen(0) and seen(0) -> (seen(0) or seen(0))",
        "x.py:late: 0 -> 1",
        "x.py:late: 0 -> 1 (2)",
    ]
    moved = f"LIMIT = LEAST\n\n\n{source}"
    assert [str(each) for each in mutants_of("x.py", moved)] == names


def test_mutants_of_changed_lines_are_those_that_a_diff_names() -> None:
    diff = (
        "--- a/x.py\n+++ b/x.py\n@@ -1 +1,2 @@ def f():\n-a = 1\n+a = 2\n+b = 3\n"
        "@@ -9,2 +10,0 @@\n-c\n-d\n--- a/y.py\n+++ b/y.py\n@@ -0,0 +7 @@\n+++x\n"
    )
    assert read_diff(diff) == {"x.py": {1, 2}, "y.py": {7}}
    lines = [each.lines for each in mutants_of("x.py", "a = 1\nb = (\n    a\n    + 2\n)\n")]
    assert lines == [(1,), (3, 4), (4,)]


@pytest.mark.parametrize("since", ["", "nothing", "--stat"])
def test_what_is_no_commit_is_said_in_a_sentence(since: str) -> None:
    with pytest.raises(ValueError, match=f"^'{since}': git knows no such commit; expected one"):
        changed_lines(ROOT, since)


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_what_reads_bytes_of_others_raises_nothing_but_its_own_errors(
    name: str, tmp_path: Path
) -> None:
    chance = random.Random(1)  # noqa: S311 -- to be repeated
    with ExitStack() as stack:
        one = built(name, stack)
        for content in [b"", b"[" * 5000, *_changed(seeds(name, tmp_path), chance)]:
            one(content)


def _changed(contents: list[bytes], chance: random.Random) -> Iterator[bytes]:
    """Each as it is, and with a byte or a piece of it otherwise."""
    for content in contents[:60]:
        yield content
        for _ in range(3):
            if content:
                at = chance.randrange(len(content))
                end = at + chance.choice((1, 1, 8))
                yield content[:at] + chance.randbytes(chance.choice((0, 1, 4))) + content[end:]


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("phase", ["keyframe", "disarming"])
def test_outputs_are_off_after_a_death_in_a_phase(
    phase: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dying, "PHASES", {phase: dying.PHASES[phase]})
    monkeypatch.setattr(dying, "KINDS", ("SIGKILL", "hang"))
    trials = [*dying._on("tachobot", 2, math.inf, random.Random(1))]  # noqa: S311
    assert [each.outcome for each in trials] == ["off", "off"]


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("path", ["stands still", "is cut"])
def test_a_network_that_fails_leaves_a_robot_well_or_off_and_said(path: str) -> None:
    trial = networks.PathTrial(board="tachobot", befalls=path, at_s=2.2, for_s=0.45, seed=1)
    found = networks.judged(trial)
    assert found is not None
    assert found.outcome in {"well", "ended"}, found.what


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("failure", machines.FAILURES)
def test_a_machine_that_fails_leaves_a_robot_well_or_off_and_said(failure: str) -> None:
    if (why := machines.why_not(failure)) is not None:
        pytest.skip(why)
    trial = machines.MachineTrial(board="tachobot", befalls=failure, at_s=0.5, step="-400d")
    found = machines.judged(trial)
    assert found.outcome in {"well", "ended"}, found.what


@pytest.mark.slow
@pytest.mark.parametrize("board", soak.BOARDS)
def test_minutes_with_faults_leave_accounts_memory_and_recording_in_order(board: str) -> None:
    soaked = soak._soaked(board, 2, robot_s=60.0, limit_s=None, is_real=False)
    assert soaked.wrong == []
    assert soaked.faults > 0
    assert soaked.keyframes > 0


def test_a_robot_that_is_soaked_again_has_its_hours_together() -> None:
    other = soak.Soaked(board="detective", faults=2)
    first = soak.Soaked(board="tachobot", commit="aaaa", faults=1, growth_mb=3.0, wrong=["it"])
    again = soak.Soaked(board="tachobot", commit="bbbb", faults=3, runs=2, ended={"failed": 1})
    (same, both) = summed([first, other], [again])
    assert same == other
    assert (both.commit, both.faults, both.runs, both.growth_mb) == ("aaaa, bbbb", 4, 3, 3.0)
    assert (both.ended, both.wrong) == ({"failed": 1}, ["it"])


def test_what_is_fuzzed_again_has_its_inputs_together_and_what_was_found_now() -> None:
    earlier = fuzzing.Fuzzed("keys", 10, "ValueError", "aaaa")
    now = fuzzing.Fuzzed("keys", 5, "", "bbbb")
    assert now.after(earlier) == fuzzing.Fuzzed("keys", 15, "", "aaaa, bbbb")
    assert now.after(now).commit == "bbbb"
    assert summed([], [now]) == [now]


def test_the_document_is_what_the_results_say() -> None:
    assert document.DOCUMENT.read_text(encoding="utf-8") == document.text()
    table = document.SAFETY.read_text(encoding="utf-8").partition(document.BEGIN)[2]
    assert table.partition(document.END)[0].strip() == "\n".join(document.phases())


def test_a_result_is_kept_with_its_day_commit_and_conditions(tmp_path: Path) -> None:
    result = Result(name="soak", summary="done", is_sound=True, figures={"boards": []})
    keep(result, 12.5, tmp_path)
    kept = read_kept("soak", tmp_path)
    assert kept is not None
    assert replace(kept.result) == result
    assert kept.commit
    assert "Done. Measured on " in document.text(tmp_path)
    assert "Not measured yet." in document.text(tmp_path)


@pytest.mark.parametrize(
    "board",
    sorted({*campaigns.BOARDS, *dying.BOARDS, *soak.BOARDS, *networks.BOARDS, *machines.BOARDS}),
)
def test_each_robot_of_a_part_is_a_board(board: str) -> None:
    assert board_in_force(board, ()).name == board


def test_no_kept_result_names_a_place_of_the_machine_that_made_it() -> None:
    for file in KEPT.glob("*.json"):
        assert '"/' not in file.read_text(encoding="utf-8"), file


@pytest.mark.parametrize("name", planted.MISTAKES)
def test_a_mistake_can_be_planted_in_this_code(name: str) -> None:
    mistake = planted.MISTAKES[name]
    assert (ROOT / mistake.file).read_text(encoding="utf-8").count(mistake.old) == 1


@pytest.mark.slow
def test_a_mistake_that_shows_without_any_fault_is_found_by_a_campaign() -> None:
    found = planted.found_in(planted.MISTAKES["the sign of the compass is turned"], runs=1)
    assert found is not None
    assert found[0].startswith("invented of controller.heading_check")
