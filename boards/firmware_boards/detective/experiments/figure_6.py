"""Figure 6: its event file on the model, in virtual time, line by line beside its output file."""

from itertools import zip_longest
from pathlib import Path
from typing import Final

from firmware_runtime.ecdpp.event_file import parse_events
from firmware_runtime.ecdpp.experiment import OutputLine, run_events
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.experiments.findings import Findings
from firmware_runtime.lab.experiments.trial import Trial
from firmware_runtime.view.parts import Series, curve, table

EVENTS: Final = (Path(__file__).parents[1] / "figure6.ev").read_text(encoding="utf-8")
PUBLISHED: Final = (
    "00:00:02:020 out2 1",
    "00:00:02:020 out3 1",
    "00:00:02:030 out1 1",
    "00:00:05:030 out1 0",
    "00:00:05:040 out2 0",
    "00:00:05:040 out3 0",
    "00:00:09:030 out2 1",
    "00:00:09:030 out3 2",
    "00:00:11:080 out3 1",
    "00:00:15:030 out2 0",
    "00:00:15:030 out3 0",
)
_MOTORS: Final = {"out1": "out1, radar", "out2": "out2, right tread", "out3": "out3, left tread"}
_END_S: Final = 16.0


def run(trial: Trial) -> Findings:
    """Play the events; a line that differs is shown beside the figure's."""
    if trial.board.event_model is None:
        raise ConfigError.of_one(trial.board.name, "its model takes no event files")
    model = trial.board.event_model(None)
    lines = run_events(model, parse_events(EVENTS, "Figure 6", model))
    rows = list(zip_longest(PUBLISHED, map(str, lines), fillvalue=""))
    equal = sum(theirs == ours for theirs, ours in rows)
    return Findings(
        ours={"output_lines": len(lines), "lines_equal": equal},
        sentences=[f"{equal} of {len(rows)} output lines are those of Figure 6."],
        plots={"": _plot(lines)},
        data={"": ["published,ours", *(",".join(row) for row in rows)]},
        tables=[table("Output lines", ("Figure 6", "ours"), rows)],
        between=["simulation: the model alone, in virtual time"],
    )


def _plot(lines: list[OutputLine]) -> Series:
    """The last command to each motor, over time."""
    curves = []
    for port, name in _MOTORS.items():
        points = [(0.0, 0.0)]
        for line in lines:
            if line.port == port:
                at_s = line.at / 1e9
                points += [(at_s, points[-1][1]), (at_s, float(str(line.value)))]
        curves.append(curve(name, [*points, (_END_S, points[-1][1])]))
    up = "0 stop, 1 clockwise, 2 counterclockwise"
    return Series("Commands to the motors", "time (s)", up, curves)
