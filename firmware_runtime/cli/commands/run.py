"""`firmware-runtime run BOARD`: run a robot, on its doubles or on its chips."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from time import monotonic_ns
from typing import TYPE_CHECKING

from firmware_runtime.board import registry
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board, is_model
from firmware_runtime.cli.run_options import (
    add_input_option,
    add_run_options,
    add_stage_options,
    choose_clock,
    choose_stage,
    clock_of,
)
from firmware_runtime.cli.run_report import Report
from firmware_runtime.devs.time import MICROSECOND, SECOND, seconds
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status, text_of
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.recording.blackbox.locations import recording_beside, recording_of_virtual_run
from firmware_runtime.runs.arming import permission_for
from firmware_runtime.runs.progress_line import Messages, progress_shown
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session, way_of
from firmware_runtime.runs.tuning import Reloading
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.paths import check_ending, default_path
from firmware_runtime.system.command_garbage import no_collection_of_what_a_verb_loads
from firmware_runtime.system.messages import Journal, Notices
from firmware_runtime.system.packages import refuse_ros
from firmware_runtime.system.signals import stop_on_signals
from firmware_runtime.system.terminal import OutputError, not_printed, readers_may_go
from firmware_runtime.system.this_process import started_at

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd
    from firmware_runtime.hal.strike import Strike
    from firmware_runtime.lab.stages.reports import EndReports
    from firmware_runtime.runs.reporter import Reporter
    from firmware_runtime.runs.restarts import Restarts
    from firmware_runtime.runs.run_files import RunFiles


_SUMMARY = "Run a robot until its time is up or a signal stops it; or a model alone."
_ABOUT = """
MODEL is FILE.ma, or MODULE:NAME: a DEVS model of a Python module, or a class or function that makes
one, whose arguments --set NAME=VALUE states. It runs at once, in virtual time. What leaves its
output ports is printed, or written to --outputs; a quantized system (`models.qss`) as a table of
its states, or drawn by --plot.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "run", _SUMMARY, execute)
    add_board(
        verb, metavar="BOARD|MODEL", about="a board's name or file, or a model that no board has"
    )
    verb.epilog = _ABOUT
    add_run_options(verb)
    add_input_option(verb)
    add_stage_options(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Run the robot; print how it ended."""
    refuse_ros()
    _check_files(arguments)
    choose_stage(arguments)
    choose_clock(arguments)
    if arguments.events is not None or is_model(arguments.board):
        alone = import_module("firmware_runtime.cli.model_run")  # not for a robot's own start
        ended: int = alone.run_model(arguments)
        return ended
    with no_collection_of_what_a_verb_loads():
        board = chosen_board(arguments.board, arguments.assignments)
    if arguments.stage is not None and arguments.stage.has_two_ends:
        both = import_module("firmware_runtime.cli.staged")  # not for a robot's own start
        status: int = both.run_both_ends(arguments, board)
        return status
    return _run_one_process(arguments, board)


def _check_files(arguments: argparse.Namespace) -> None:
    """Refuse files that cannot be written. Raises ConfigError."""
    options = ("trace", "record", "plot", "outputs")
    stated = {f"--{each}": getattr(arguments, each) for each in options}
    if any(path is not None for path in stated.values()):
        from firmware_runtime.cli.written import check_files  # noqa: PLC0415 -- of few runs

        check_files("run", stated)


def _run_one_process(arguments: argparse.Namespace, board: registry.Board) -> int:
    """Run a robot, or one end of it, in this process, however often a manager starts it again."""
    messages = Messages()
    if arguments.loop is not None:
        loop_model = import_module("firmware_runtime.lab.experiments.loop_model")
        board = loop_model.loop_board(board, arguments.loop)
    end = _end_of(arguments, board)
    path, notices = _statistics_path(arguments, board, end), Notices.from_environment()
    within = seconds(board.settings.executive.bring_up_s)

    def run(restarts: "Restarts | None") -> int:
        notices.progress("starts: finds its chips", within)
        with no_collection_of_what_a_verb_loads():
            session = _session(arguments, board, end, path, messages)
        notices.progress("starts: takes its first step", within)
        if restarts is not None:
            session.executive.hooks.append(restarts)
        return _run(arguments, session, notices, messages)

    if path is None or not notices.is_there:
        return run(None)
    from firmware_runtime.runs.restarts import counted  # noqa: PLC0415 -- of a service

    return counted(run, path, notices, within)


def _session(
    arguments: argparse.Namespace,
    board: registry.Board,
    end: "BoardEnd | None",
    path: Path | None,
    messages: Messages,
) -> Session:
    """The robot with its chips found, as the command line has it."""
    supervised = {"arm": arguments.arm, "supervised": arguments.supervised}
    doubles, called_at = arguments.doubles, arguments.called_at
    begun_at = started_at() if called_at is None else called_at
    return start_session(
        board,
        clock_of(arguments),
        doubles=doubles,
        statistics_path=path,
        permission=permission_for(board, doubles=doubles, end=end, begun_at=begun_at, **supervised),
        end=end,
        link=way_of(arguments.link),
        recording=_recording_path(arguments, board, path),
        faults=arguments.fault,
        log=messages,
    )


def _run(
    arguments: argparse.Namespace, session: Session, notices: Notices, messages: Messages
) -> int:
    """Run it; its files are written to their ends once the hardware is released."""
    executive, files = session.executive, _files(arguments, messages)
    try:
        with closing(session):
            draw = _plotting(session, arguments.plot)
            report = Report(session, arguments, messages)
            _plan_inputs(session, arguments, report.until)
            _refuse_faults_after(report.until, arguments.fault)
            reports = _reports(session, arguments.report_to)
            if files is not None:
                files.begin(session, arguments.trace, arguments.record)
            with (
                _serving(session, notices, messages) as reload,
                progress_shown(session, report.until, messages, wanted=not arguments.json),
                stop_on_signals(
                    executive.request_stop,
                    reload,
                    executive.give_up,
                    is_driving=executive.clock.speed != 0,
                ),
            ):
                report.begin()
                outcome = session.run(report.until)
                if reports is not None:
                    reports.keep_signals_off()
            if isinstance(outcome.error, StatisticsFileError):
                raise outcome.error  # the run never began: bad input, like a board's
            status: int = _status(outcome, session)
            try:
                with readers_may_go():
                    report.end(outcome)
            except OutputError as error:
                not_printed(error)
                status = status or Status.NOT_PRINTED
            status = status or report.defect
            try:
                draw(outcome.reason)
            except ConfigError as error:
                messages(text_of(error))
                status = status or Status.NOT_PRINTED
    finally:
        written = Status.OK if files is None else files.close()
    if reports is not None:
        reports.close()
    return status or written


def _files(arguments: argparse.Namespace, messages: Messages) -> "RunFiles | None":
    """Return the files that the run is to leave beside its statistics; None for none."""
    if arguments.trace is None and arguments.record is None:
        return None
    from firmware_runtime.runs.run_files import RunFiles  # noqa: PLC0415 -- of few runs

    return RunFiles(messages)


def _plan_inputs(session: Session, arguments: argparse.Namespace, end: int) -> None:
    """Let the values of `--input` arrive when they are due. Raises ConfigError."""
    if arguments.inputs:
        from firmware_runtime.runs.planned_inputs import plan_inputs  # noqa: PLC0415 -- of few runs

        model, name = session.robot.model, session.board.name
        plan_inputs(session.executive, model, name, arguments.inputs, end)


def _refuse_faults_after(end: int, faults: "list[Strike]") -> None:
    """Refuse faults that the run would never meet. Raises ConfigError."""
    late = [
        f"--fault {each.at_s:g}:{each.kind}: the run ends at {end / SECOND:g} s; "
        "expected an earlier second"
        for each in faults
        if each.at > end
    ]
    if late:
        raise ConfigError("run", late)


def _end_of(arguments: argparse.Namespace, board: registry.Board) -> "BoardEnd | None":
    """The end that is to be run; None for the whole robot. Raises ConfigError."""
    if arguments.role is None and arguments.link is None:
        return None
    if arguments.role is None or arguments.link is None:
        fault = "--role and --link belong together; expected both or neither"
        raise ConfigError("run", [fault])
    from firmware_runtime.board.ends import end_of  # noqa: PLC0415 -- few runs are of one end

    end = end_of(board, arguments.role)
    if arguments.loop is not None:
        loop_model = import_module("firmware_runtime.lab.experiments.loop_model")
        end = loop_model.loop_end(end)
    from firmware_runtime.runs.end_link import idle_options  # noqa: PLC0415 -- of an end only

    idle = ("doubles", "arm", "supervised")
    faults = idle_options(end, **{f"--{name}": getattr(arguments, name) for name in idle})
    if faults:
        raise ConfigError("run", faults)
    return end


def _reports(session: Session, descriptor: int | None) -> "EndReports | None":
    """What reports to the command of a stage how this end of it fares."""
    if descriptor is None:
        return None
    if session.linked is not None:  # the time of a stage is that of its controller
        session.linked.ends_both = True
    from firmware_runtime.lab.stages.reports import EndReports  # noqa: PLC0415 -- of a stage only

    return EndReports(session.executive, descriptor, session.shown, lambda: _standing(session))


def _standing(session: Session) -> dict[str, object]:
    """Whether it is armed, and how its link stands."""
    arming, linked = session.arming, session.linked
    standing: dict[str, object] = {"armed": arming is None or arming.armed}
    if linked is not None:
        peer = linked.link.peer
        round_trip = peer.clock.round_trip
        standing["link"] = {
            "why_bad": peer.why_bad(monotonic_ns()),
            "age_us": None if round_trip is None else round_trip / 2 / MICROSECOND,
        }
    return standing


def _statistics_path(
    arguments: argparse.Namespace, board: registry.Board, end: "BoardEnd | None"
) -> Path | None:
    if arguments.statistics is not None or arguments.clock == "virtual":
        path: Path | None = arguments.statistics
        if path is not None:
            check_ending(path)
        return path
    return default_path(board.name if end is None else end.name)


def _recording_path(
    arguments: argparse.Namespace, board: registry.Board, statistics: Path | None
) -> Path | None:
    """Where it is kept what enters the run; a loop's delay is measured without."""
    if arguments.loop is not None:
        if arguments.record is not None:
            fault = "--loop measures a delay, and nothing is recorded of it"
            raise ConfigError.of_one("run", fault, expected="it without --record")
        return None
    if statistics is not None:
        return recording_beside(statistics)
    return recording_of_virtual_run(board.name)


def _plotting(session: Session, path: Path | None) -> Callable[[str], None]:
    """What draws the run when it is over, and why it was; refuses a picture that cannot be made.

    What draws is imported only if there is something to draw.
    """
    if path is None:
        return lambda _reason: None
    plot = import_module("firmware_runtime.runs.picture_of_run")
    plot.check_plot(session, path)
    return lambda reason: plot.write_plot(session, path, reason)


def _reporter(executive: Executive, notices: Notices, journal: Journal) -> "Reporter | None":
    """Return what reports to systemd and the journal, where there is one of them."""
    if not (notices.is_there or journal.is_there):
        return None
    # neither is there at a terminal
    from firmware_runtime.runs.reporter import Reporter  # noqa: PLC0415
    from firmware_runtime.statistics.summary import summary  # noqa: PLC0415

    return Reporter(executive, notices, journal, summary)


@contextmanager
def _serving(
    session: Session, notices: Notices, messages: Messages
) -> Iterator[Callable[[], None] | None]:
    """Report to systemd and the journal; yields what SIGHUP is for, None at a terminal."""
    journal = Journal.from_environment()
    executive = session.executive
    reporter = _reporter(executive, notices, journal)
    reloading = Reloading(session.tuning, executive, notices, messages)
    try:
        yield None if sys.stdin.isatty() else reloading.request
    finally:
        if reporter is not None:
            reporter.close()
        notices.stopping()
        notices.close()
        journal.close()


def _status(outcome: Outcome, session: Session) -> Status:
    if outcome.faults:
        return Status.NOT_SAFE
    stopped_by = session.executive.stopped_by
    ended_by_itself = session.task.ending is not None or outcome.state is RunState.OVERRUN
    if stopped_by is not None and not ended_by_itself and outcome.error is None:
        # also where a device had never been ready: a service that is stopped has not failed
        return Status.INTERRUPTED if stopped_by == "SIGINT" else Status.TERMINATED
    if outcome.state in {RunState.FAILED, RunState.OVERRUN} or session.task.has_failed:
        return Status.MODEL_ERROR
    return Status.OK
