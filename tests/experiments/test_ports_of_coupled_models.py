"""What left a coupled model, by its own port's name, in the trace of a run."""

import json
from pathlib import Path

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.senders import Senders
from firmware_runtime.lab.experiments.trial import Traced


def test_a_coupled_models_port_has_what_was_sent_through_it(tmp_path: Path) -> None:
    robot, brain, aim = Coupled("robot"), Coupled("brain"), Atomic("aim")
    robot.add(brain).add(aim)
    brain.couple(aim.out_port("angle", float), brain.out_port("turn", float))
    trace = tmp_path / "trace.jsonl"
    lines = [{"t_ns": 10**9, "port": port, "value": 0.5} for port in ("brain.aim.angle", "other")]
    trace.write_text("\n".join(map(json.dumps, lines)))
    ran = Traced({"statistics": {}}, trace, None, senders=Senders(robot))
    assert ran.points("brain.turn") == ran.points("brain.aim.angle") == [(1.0, 0.5)]
    assert ran.points("brain.nothing") == []
