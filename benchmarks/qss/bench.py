"""Steps, error and CPU time of quantized state systems beside `solve_ivp`, at equal error.

The peer gets the loosest tolerance of a ladder with which it is at least as accurate as we are, at
the same 201 instants; both are timed whole, building the model included, the best of several runs
in turns. Reference: the peer's DOP853, or Radau where stiff, at a tolerance of 1e-12.
"""

import argparse
import json
import sys
from time import process_time
from typing import Any

from benchmarks.qss.problems import Problem, problems
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import conditions, positive
from firmware_runtime.devs.time import seconds
from firmware_runtime.extras import install_command
from firmware_runtime.models.qss import Simulation
from firmware_runtime.status import Status

SUMMARY = "Quantized state systems beside scipy's solve_ivp, at equal error."
_LADDER = [10.0 ** (-number / 2) for number in range(4, 25)]
_REFERENCE = 1e-12
_HEADER = (
    f"{'':16}{'':>8}{'steps':>7}{'error':>10}{'CPU':>10}"
    f"{'solve_ivp':>12}{'steps':>7}{'error':>10}{'CPU':>10}{'ratio':>7}"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--repetitions", type=positive, default=5, help="runs of each; default 5")


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the median ratio of CPU times, the peer's by ours, comes last."""
    try:
        import scipy  # noqa: F401, PLC0415 -- an extra; the rest of the benches needs none
    except ImportError:
        print(
            "firmware-runtime: bench qss: scipy is not installed; expected the extra tuning: "
            f"{install_command('tuning')}",
            file=sys.stderr,
        )
        return Status.BAD_INPUT
    found = [_measured(problem, arguments.repetitions) for problem in problems()]
    ratios = sorted(each["ratio"] for each in found)
    report = {"conditions": conditions(), "systems": found, "ratio": ratios[len(ratios) // 2]}
    save(arguments.save, "qss", report)
    print(json.dumps(report) if arguments.json else _text(report))
    return Status.OK


def _measured(problem: Problem, repetitions: int) -> dict[str, Any]:
    import numpy as np  # noqa: PLC0415

    from benchmarks.qss.peer import solved  # noqa: PLC0415 -- it needs scipy

    print(f"bench qss: {problem.name}", file=sys.stderr)
    is_stiff = problem.peer_method == "Radau"
    exact, _ = solved(problem, _REFERENCE, "Radau" if is_stiff else "DOP853")
    values, steps = _ours(problem)
    error = float(np.abs(np.array(values) - exact).max())
    rtol, peer_error = _REFERENCE, 0.0
    for rtol in _LADDER:
        peer_error = float(np.abs(solved(problem, rtol)[0] - exact).max())
        if peer_error <= error:
            break
    ours, peers = [], []
    for _ in range(repetitions):
        ours.append(_timed(lambda: _ours(problem)))
        peers.append(_timed(lambda: solved(problem, rtol)))
    return {
        "name": problem.name,
        "method": problem.system.method,
        "quantum": problem.system.quantum,
        "peer": problem.peer_method,
        "rtol": rtol,
        "steps": {"ours": steps, "peer": solved(problem, rtol)[1]},
        "error": {"ours": error, "peer": peer_error},
        "cpu_s": {"ours": min(ours), "peer": min(peers)},
        "ratio": min(peers) / min(ours),
    }


def _ours(problem: Problem) -> tuple[list[list[float]], int]:
    simulation = Simulation(problem.system)
    rows: list[list[float]] = [[] for _ in problem.system.states]
    for t in problem.times:
        simulation.advance(seconds(t))
        for row, value in zip(rows, simulation.values.values(), strict=True):
            row.append(value)
    return rows, simulation.model.steps


def _timed(work: Any) -> float:  # noqa: ANN401 -- whatever it returns is dropped
    begin = process_time()
    work()
    return process_time() - begin


def _text(report: dict[str, Any]) -> str:
    found = report["conditions"]
    lines = [
        "steps, largest error and CPU time, set-up included, at equal error",
        "{python} on {system} {machine}, {cpu}, {cpus} CPUs, load {load}".format(**found),
        "",
        _HEADER,
    ]
    for each in report["systems"]:
        steps, error, cpu = each["steps"], each["error"], each["cpu_s"]
        lines.append(
            f"{each['name']:16}{each['method']:>8}{steps['ours']:7}{error['ours']:10.1e}"
            f"{cpu['ours'] * 1e3:7.1f} ms{each['peer']:>12}{steps['peer']:7}{error['peer']:10.1e}"
            f"{cpu['peer'] * 1e3:7.1f} ms{each['ratio']:7.2f}"
        )
    lines += ["", f"ratio {report['ratio']:.2f} (median, solve_ivp's CPU time by ours)"]
    return "\n".join(lines)
