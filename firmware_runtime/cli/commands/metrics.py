"""`firmware-runtime metrics [BOARD]`: statistics for Prometheus, as a text file or over HTTP."""

import argparse
from pathlib import Path
from socketserver import BaseServer
from threading import Thread

from firmware_runtime.cli.arguments import SubParsers, add_verb, positive
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.statistics.paths import all_statistics
from firmware_runtime.system.atomic_file import keep_output
from firmware_runtime.system.packages import module_of_extra
from firmware_runtime.system.signals import until_signal


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Give the statistics to Prometheus; needs the extra `metrics`."
    verb = add_verb(verbs, "metrics", summary, execute)
    verb.add_argument(
        "board", metavar="BOARD", nargs="?", help="a board's name; default: every board that ran"
    )
    ways = verb.add_mutually_exclusive_group(required=True)
    ways.add_argument(
        "--textfile", type=Path, metavar="FILE", help="write it for node_exporter's collector"
    )
    ways.add_argument(
        "--listen",
        metavar="ADDRESS",
        help="serve it on 127.0.0.1:PORT or unix:PATH until a signal comes",
    )
    verb.add_argument(
        "--every",
        type=positive,
        metavar="SECONDS",
        dest="every_s",
        help="write the text file again and again, until a signal comes",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write or serve."""
    if arguments.every_s is not None and arguments.textfile is None:
        raise ConfigError("metrics", ["--every belongs to --textfile"])
    collecting = module_of_extra("firmware_runtime.statistics.metrics", "metrics")
    collector = collecting.StatisticsCollector(lambda: all_statistics(arguments.board))
    if arguments.listen is not None:
        serving = module_of_extra("firmware_runtime.statistics.metrics_server", "metrics")
        _serve(serving.exporter(arguments.listen, collector))
        return Status.OK
    with until_signal() as signal:
        _write(arguments.textfile, collecting.text_of(collector))
        while arguments.every_s is not None and not signal.wait(arguments.every_s):
            _write(arguments.textfile, collecting.text_of(collector))
    return Status.OK


def _write(path: Path, text: str) -> None:
    """Replace the file at once, for an exporter that runs as a user of its own."""
    keep_output(path, text.encode(), "--textfile", 0o644)


def _serve(server: BaseServer) -> None:
    with until_signal() as signal, server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        print(f"serving metrics on {server.server_address}", flush=True)
        signal.wait()
        server.shutdown()
        thread.join()
