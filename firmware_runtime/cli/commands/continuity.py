"""`firmware-runtime continuity BOARD`: every stage run, recorded and replayed."""

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_runtime.board.roles import Stage
from firmware_runtime.cli.arguments import (
    SubParsers,
    add_board,
    add_duration,
    add_output,
    add_verb,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.written import check_output
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.continuity.certificate import Certificate
from firmware_runtime.lab.continuity.certificate_page import certificate_page
from firmware_runtime.lab.continuity.stage_run import StageRun, run_stage
from firmware_runtime.lab.stages.staged_run import Staged, own_state
from firmware_runtime.lab.stages.way import WIFI
from firmware_runtime.links.cut.impaired_path import impairment
from firmware_runtime.recording.blackbox.state_of_run import UNKEPT
from firmware_runtime.recording.replay.verdict import difference_in_words
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.system.signals import exit_on_signals
from firmware_runtime.system.terminal import print_line
from firmware_runtime.view.page import page_of

_ABOUT = """
Each stage runs on doubles, in processes of its own. What entered them enters the same drivers and
models again in virtual time, and all that leaves these is compared with the run's, floats to the
bit. Stages are not compared with one another: other samples enter in each. Exit status 0: each
stage that was run is its replay, on the same code and settings; 1: one is not, went wrong, or none
ran; 12: none differs, but not everything could be compared.
"""
_SUFFIXES = (".json", ".html")


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Run a board in every stage; certify that each run replays bit for bit."
    verb = add_verb(verbs, "continuity", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    _add_stages(verb)
    add_output(verb, "the certificate: FILE.json for programs, FILE.html for people", required=True)
    verb.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="keep each stage's recording here, as STAGE.recording, for `replay`",
    )


def _add_stages(verb: argparse.ArgumentParser) -> None:
    """What is run, and for how long."""
    add_duration(verb, "robot time of each stage; default as the board says for a run on doubles")
    verb.add_argument(
        "--stages",
        nargs="+",
        choices=[stage.value for stage in Stage],
        default=[stage.value for stage in Stage],
        metavar="STAGE",
        help=f"which stages to run: {', '.join(Stage)}; default all",
    )
    verb.add_argument(
        "--impair",
        metavar="HOW",
        help="the network of stage remote, as `run --impair` has it; default 40 ms each way, "
        "10 ms of jitter, 2%% lost",
    )
    verb.add_argument(
        "--link",
        choices=("udp", "ros2"),
        default="udp",
        help="what is between the ends in stage network: UDP on loopback, or topics of ROS 2",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the stages, write the certificate, print what became of each."""
    output: Path = arguments.output
    check_output(output, _SUFFIXES)
    how = WIFI if arguments.impair is None else impairment(arguments.impair)
    _refuse_without_effect(arguments)
    board = chosen_board(arguments.board, arguments.assignments)
    duration_s = arguments.duration_s or board.doubles_run_s
    plan = Staged(
        board=board,
        named=arguments.board,
        for_s=duration_s,
        how=how,
        is_over_ros=arguments.link == "ros2",
    )
    with exit_on_signals(), own_state(), _folder(arguments.keep) as folder:
        runs = list(_runs(plan, arguments.stages, folder))
        certificate = Certificate(plan, runs)
        _write(certificate, output)
    verdict = certificate.verdict
    print(f"{verdict if certificate.is_identical else verdict.upper()}: {output}")
    return certificate.status


def _refuse_without_effect(arguments: argparse.Namespace) -> None:
    stated = {Stage.NETWORK: arguments.link != "udp", Stage.REMOTE: arguments.impair is not None}
    options = {Stage.NETWORK: f"--link {arguments.link}", Stage.REMOTE: "--impair"}
    faults = [
        f"{options[stage]} belongs to stage {stage}, which --stages leaves out"
        for stage, is_stated in stated.items()
        if is_stated and stage not in arguments.stages
    ]
    if faults:
        raise ConfigError("continuity", faults)


@contextmanager
def _folder(stated: Path | None) -> Iterator[Path]:
    """Where recordings are kept: a folder that stays, or one that goes. Raises ConfigError."""
    if stated is None:
        with own_folder() as folder:
            yield folder
        return
    try:
        stated.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fault = f"{stated}: {error.strerror}; expected a folder that can be made"
        raise ConfigError("--keep", [fault]) from error
    yield stated


def _runs(plan: Staged, stages: list[str], folder: Path) -> Iterator[StageRun]:
    for stage in Stage:
        if stage.value not in stages:
            yield StageRun(stage, "left out by --stages")
            continue
        print_line(
            f"{stage}: runs for {plan.for_s:g} s of {plan.board.name}'s time ...", sys.stderr
        )
        run = run_stage(plan, stage, folder)
        print("\n".join(_said(run)), flush=True)
        yield run


def _said(run: StageRun) -> Iterator[str]:
    if not run.has_run:
        yield f"{run.stage}: not run: {run.why_not}"
        return
    if run.failed is not None:
        yield f"{run.stage}: {run.failed}"
    for role, end in run.ends.items():
        verdict = end.verdict
        yield f"{run.stage}, {role}: {verdict.in_words}"
        if end.fault is not None:
            yield f"  {end.fault}"
        if verdict.first is not None:
            yield from difference_in_words(verdict.first)
            if verdict.has_drawn:
                yield f"  {UNKEPT}"


def _write(certificate: Certificate, output: Path) -> None:
    """Write the file its ending asks for. Raises ConfigError where that cannot be."""
    if output.suffix == ".html":
        text = page_of(certificate_page(certificate))
    else:
        text = json.dumps(certificate.as_json(), indent=1, allow_nan=False) + "\n"
    keep_output(output, text.encode())
