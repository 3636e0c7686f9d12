"""`firmware-runtime stats [BOARD]`: read a run's statistics, while it runs or after it died."""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Final

import msgspec

from firmware_runtime.cli.after_virtual_run import say_if_last_run_was_virtual
from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb, positive, whole
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.statistics.comparison import difference, merged, same_run
from firmware_runtime.statistics.difference_text import difference_of, difference_text
from firmware_runtime.statistics.file import save
from firmware_runtime.statistics.histogram_text import histogram_text
from firmware_runtime.statistics.paths import all_statistics, find_statistics
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.statistics.takeovers import Takeover, takeovers_of
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import until_signal

SCREEN: Final = Path("-")
"""Where `--prometheus` writes without a file."""
_IDLE = {
    "statistics": ("board", "serve"),
    "merge": ("board", "since", "serve"),
    "diff": ("board", "since", "save", "prometheus", "histogram", "serve"),
    "serve": ("since", "save"),
}
"""By option, those that would have no effect beside it, as far as argparse does not know it."""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Show the statistics of the run under way, or of the last; reading changes nothing."
    verb = add_verb(verbs, "stats", summary, execute)
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", help="a board's name; default: whatever ran last"
    )
    _add_sources(verb)
    _add_forms(verb)
    verb.add_argument(
        "--since",
        type=Path,
        metavar="CURSOR",
        help="only what came since the last time with this file, which then notes this time",
    )
    verb.add_argument(
        "--save", type=Path, metavar="FILE", help="keep what was read in a file like the run's own"
    )
    verb.add_argument(
        "--worst", type=whole, default=3, metavar="N", help="how many of the worst; default 3"
    )
    verb.add_argument(
        "--every",
        type=positive,
        metavar="SECONDS",
        dest="every_s",
        help="write the file of --prometheus again and again, until a signal comes",
    )


def _add_sources(verb: argparse.ArgumentParser) -> None:
    sources = verb.add_mutually_exclusive_group()
    add_statistics(sources, "read this file instead")
    sources.add_argument(
        "--merge",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="add up several runs of one board, of one robot or of many",
    )
    sources.add_argument(
        "--diff", type=Path, nargs=2, metavar=("A", "B"), help="compare two runs, figure by figure"
    )


def _add_forms(verb: argparse.ArgumentParser) -> None:
    forms = verb.add_mutually_exclusive_group()
    forms.add_argument("--json", action="store_true", help="print them as JSON")
    forms.add_argument(
        "--prometheus",
        type=Path,
        nargs="?",
        const=SCREEN,
        metavar="FILE",
        help="print those of BOARD, or of every board that ran, as Prometheus reads them; or write "
        "FILE for node_exporter's collector",
    )
    forms.add_argument(
        "--serve",
        metavar="ADDRESS",
        help="serve the same on 127.0.0.1:PORT or unix:PATH until a signal comes",
    )
    forms.add_argument(
        "--histogram",
        action="store_true",
        help="print the lateness of each model as cyclictest prints its histogram",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Print the statistics; StatisticsFileError says why there are none."""
    _refuse_what_has_no_effect(arguments)
    if arguments.diff is not None:
        _print_difference(arguments)
        return Status.OK
    if arguments.serve is not None:
        _serve(arguments)
        return Status.OK
    if arguments.prometheus is not None and _is_of_boards(arguments):
        _expose(arguments)
        return Status.OK
    statistics = _read(arguments)
    if arguments.save is not None:
        save(statistics, arguments.save)
    for line in _lines(arguments, statistics, _takeovers(arguments, statistics)):
        print(line)
    return Status.OK


def _refuse_what_has_no_effect(arguments: argparse.Namespace) -> None:
    """Refuse options that do not go together. Raises ConfigError."""

    def is_given(name: str) -> bool:
        return not (getattr(arguments, name) is None or getattr(arguments, name) is False)

    faults = [
        f"{_spelled(other)} does not go together with {_spelled(name)}"
        for name, idle in _IDLE.items()
        if is_given(name)
        for other in idle
        if is_given(other)
    ]
    if arguments.every_s is not None and arguments.prometheus in {None, SCREEN}:
        faults.append("--every belongs to --prometheus FILE")
    if faults:
        raise ConfigError("stats", faults)


def _spelled(name: str) -> str:
    return "BOARD" if name == "board" else f"--{name}"


def _read(arguments: argparse.Namespace) -> Statistics:
    if arguments.merge is not None:
        return merged([read_statistics(path) for path in arguments.merge])
    path = arguments.statistics or find_statistics(arguments.board)
    now = read_statistics(path)
    say_if_last_run_was_virtual(path, now)
    return now if arguments.since is None else _since(now, arguments.since)


def _since(now: Statistics, cursor: Path) -> Statistics:
    """What came since the cursor, which is moved to now."""
    before = read_statistics(cursor) if cursor.exists() else None
    save(now, cursor)
    if before is None or not same_run(now, before):
        return now  # a run of which the cursor knows nothing yet: all of it is new
    return difference(now, before)


def _takeovers(arguments: argparse.Namespace, statistics: Statistics) -> list[Takeover]:
    """What a guard took from this run; nothing for what several runs add up to."""
    if arguments.merge is not None:
        return []
    path = arguments.statistics or find_statistics(arguments.board)
    return takeovers_of(path, statistics.header.writer)


def _lines(
    arguments: argparse.Namespace, statistics: Statistics, takeovers: Sequence[Takeover]
) -> Iterable[str]:
    if arguments.prometheus is not None:
        board = statistics.header.board or "unnamed"
        text = _collecting().exposition(board, statistics)
        if arguments.prometheus != SCREEN:
            _write(arguments.prometheus, text)
            return []
        return [text.rstrip()]
    if arguments.histogram:
        return histogram_text(statistics)
    if arguments.json:
        noted = msgspec.to_builtins(takeovers)
        return [json.dumps({**statistics.as_json(), "takeovers": noted}, allow_nan=False)]
    latest = takeovers[max(len(takeovers) - arguments.worst, 0) :]
    lines = [f"  guard: {takeover.text()}" for takeover in latest]
    return [*statistics_text(statistics.figures(), arguments.worst), *lines]


def _print_difference(arguments: argparse.Namespace) -> None:
    found = difference_of(*(read_statistics(path) for path in arguments.diff))
    if arguments.json:
        print(json.dumps(found.as_json(), allow_nan=False))
    else:
        print("\n".join(difference_text(found)))


# For Prometheus ----------------------------------------------------------------------------------


def _is_of_boards(arguments: argparse.Namespace) -> bool:
    """Whether boards are meant, as they are at each reading, and not one file's figures."""
    is_one_file = arguments.statistics or arguments.merge or arguments.since or arguments.save
    return not is_one_file


def _expose(arguments: argparse.Namespace) -> None:
    """Print the boards' figures, or write them, once or every so often."""
    target: Path = arguments.prometheus
    if target == SCREEN:
        find_statistics(arguments.board)  # raises where there is none
        print(_collecting().text_of(_collector(arguments)).rstrip())
        return
    collector = _collector(arguments)
    with until_signal() as signal:
        _write(target, _collecting().text_of(collector))
        while arguments.every_s is not None and not signal.wait(arguments.every_s):
            _write(target, _collecting().text_of(collector))


def _serve(arguments: argparse.Namespace) -> None:
    serving = module_of_extra("firmware_runtime.statistics.metrics_server", "metrics")
    with until_signal() as signal:

        def wait(address: str) -> None:
            print(f"serving metrics on {address}", flush=True)
            signal.wait()

        serving.serve(arguments.serve, _collector(arguments), wait)


def _collector(arguments: argparse.Namespace) -> object:
    """What reads the statistics of the board, or of every board that ran, when it is asked."""
    return _collecting().StatisticsCollector(lambda: all_statistics(arguments.board))


def _collecting() -> ModuleType:
    """Return what speaks Prometheus. Raises ConfigError without the extra."""
    return module_of_extra("firmware_runtime.statistics.metrics", "metrics")


def _write(path: Path, text: str) -> None:
    """Replace the file at once, for an exporter that runs as a user of its own."""
    keep_output(path, text.encode(), "--prometheus", 0o644)
