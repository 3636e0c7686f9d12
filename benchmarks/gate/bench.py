"""How often the timing gate is wrong: `firmware-runtime bench gate`.

TachoBot against itself, and against itself with a longer step, in turns, each decision with a seed
of its own, while neighbours keep the processors busy. A false alarm is `slower` of the same code.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.gate.apart import apart
from benchmarks.gate.neighbours import busy_neighbours
from benchmarks.gate.versions import BOARD, Versions, make_versions
from benchmarks.loop.certainty import CERTAINTY, highest_share
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.gate.board_pairs import BoardPairs
from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.gate import Outcome, pass_gate
from firmware_runtime.gate.sequential import Verdict
from firmware_runtime.status import Status
from firmware_runtime.system.exit_on_signals import exit_on_signals

SUMMARY = "How often the timing gate is wrong, beside busy neighbours."
SAME, LONGER = "the same code", "a longer step"
_RIGHT = {SAME: Verdict.NO_SLOWER, LONGER: Verdict.SLOWER}
_SAID_EVERY = 10


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument(
        "--decisions", type=positive, default=100, metavar="N", help="of each kind; default 100"
    )
    parser.add_argument(
        "--neighbours", type=_count, default=2, metavar="N", help="busy processes; default 2"
    )
    parser.add_argument(
        "--longer",
        type=positive_number,
        default=20.0,
        metavar="PERCENT",
        help="how much longer a step is made; default 20",
    )
    parser.add_argument(
        "--tolerance", type=positive_number, default=10.0, metavar="PERCENT", help="default 10"
    )
    parser.add_argument("--pairs", type=positive, default=96, help="at most; default 96")


def _count(text: str) -> int:
    with suppress(ValueError):
        if int(text) >= 0:
            return int(text)
    raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, 0 or more")


def execute(arguments: argparse.Namespace) -> int:
    """Decide so often; the ratio of the longer step comes last."""
    before = conditions()
    with exit_on_signals(), TemporaryDirectory(prefix="gate-bench-") as folder:
        versions = make_versions(Path(folder), arguments.longer / 100)
        with busy_neighbours(arguments.neighbours):
            same_code = apart(versions.base)
            found = _decisions(versions, arguments)
    kinds = {kind: _summary(outcomes, _RIGHT[kind]) for kind, outcomes in found.items()}
    report = {
        "conditions": before,
        "board": BOARD,
        "neighbours": arguments.neighbours,
        "longer_percent": arguments.longer,
        "tolerance_percent": arguments.tolerance,
        "turns": versions.turns,
        "apart": same_code,
        "kinds": kinds,
        "ratio": kinds[LONGER]["ratio"],
    }
    save(arguments.save, "gate", report)
    print(json.dumps(report) if arguments.json else _text(report))
    return Status.OK


def _decisions(versions: Versions, arguments: argparse.Namespace) -> dict[str, list[Outcome]]:
    found: dict[str, list[Outcome]] = {SAME: [], LONGER: []}
    heads = {SAME: versions.same, LONGER: versions.longer}
    for number in range(arguments.decisions):
        for kind, head in heads.items():
            found[kind].append(_outcome(versions.base, head, number, arguments))
        if (number + 1) % _SAID_EVERY == 0 or number + 1 == arguments.decisions:
            said = "; ".join(f"{kind}: {_counted(outcomes)}" for kind, outcomes in found.items())
            print(f"bench gate: {number + 1} of {arguments.decisions}: {said}", file=sys.stderr)
    return found


def _outcome(base: Checkout, head: Checkout, seed: int, arguments: argparse.Namespace) -> Outcome:
    measured = BoardPairs((base, head), BOARD, [], seed)
    return pass_gate(measured, arguments.tolerance / 100, arguments.pairs)


def _counted(outcomes: Sequence[Outcome]) -> str:
    counts = Counter(each.decision.verdict for each in outcomes)
    return ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict])


def _summary(outcomes: Sequence[Outcome], right: Verdict) -> dict[str, Any]:
    counts = Counter(each.decision.verdict for each in outcomes)
    ratios = sorted(each.decision.ratio for each in outcomes)
    return {
        "decisions": len(outcomes),
        "verdicts": {verdict.value: counts[verdict] for verdict in Verdict},
        "missed_at_most": highest_share(len(outcomes) - counts[right], len(outcomes)),
        "ratio": median(ratios),
        "ratio_least": ratios[0],
        "ratio_most": ratios[-1],
        "pairs": median(each.decision.pairs for each in outcomes),
        "seconds": median(each.elapsed_s for each in outcomes),
        "seconds_most": max(each.elapsed_s for each in outcomes),
        "others": median(each.neighbours["processes"] for each in outcomes),
    }


def _text(report: dict[str, Any]) -> str:
    same = report["apart"]
    lines = [
        conditions_text(report["conditions"]),
        "",
        (
            f"{report['board']}, {report['neighbours']} busy neighbours, a step made "
            f"{report['longer_percent']:g} % longer, tolerance {report['tolerance_percent']:g} %:"
        ),
        (
            f"  {'':15}{'decisions':>10}{'no slower':>10}{'slower':>8}{'cannot tell':>12}"
            f"{'ratio':>8}{'from':>8}{'to':>8}{'pairs':>7}{'s':>6}"
        ),
        *(_row(kind, found) for kind, found in report["kinds"].items()),
        "  ratio: the median of the decisions, the least and the most; pairs, s: medians",
        *(
            f"  {kind}: another answer than that in at most {found['missed_at_most']:.1%}, "
            f"with {CERTAINTY:.0%} certainty"
            for kind, found in report["kinds"].items()
        ),
        "The dearest by the cheapest, the same code at the same time:",
        f"  processors {same['processors']:.3f}, processes on one of them {same['processes']:.3f}",
    ]
    return "\n".join([*lines, f"ratio {report['ratio']:.3f} (the longer step by the plain one)"])


def _row(kind: str, found: dict[str, Any]) -> str:
    verdicts = found["verdicts"]
    return (
        f"  {kind:15}{found['decisions']:>10}{verdicts[Verdict.NO_SLOWER]:>10}"
        f"{verdicts[Verdict.SLOWER]:>8}{verdicts[Verdict.CANNOT_TELL]:>12}{found['ratio']:>8.3f}"
        f"{found['ratio_least']:>8.3f}{found['ratio_most']:>8.3f}{found['pairs']:>7.0f}"
        f"{found['seconds']:>6.1f}"
    )
