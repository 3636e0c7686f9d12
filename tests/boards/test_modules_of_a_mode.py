"""A run of TachoBot loads what its mode needs, and nothing of the others."""

import subprocess
import sys

import pytest

OF_TRACK = {
    "firmware_boards.tachobot.course",
    "firmware_boards.tachobot.position_input",
    "firmware_boards.tachobot.track_result",
    "firmware_boards.tachobot.tracking",
    "firmware_runtime.models.position_estimator",
    "firmware_runtime.models.state_diagram",
    "firmware_runtime.models.trajectory_paths",
    "firmware_runtime.models.trajectory_source",
    "sim_doubles.worlds.position_sensor",
    "statistics",
}
OF_FEW = {
    "firmware_runtime.ecdpp.event_file",
    "firmware_runtime.models.qss",
    "firmware_runtime.models.smith_predictor",
    "firmware_runtime.models.square_wave",
    "numpy",
}


PROGRAM = """
import sys
from firmware_runtime.cli.main import main
for mode in ("platform", "track"):
    words = ["run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1"]
    sys.argv[1:] = [*words, "--set", f"controller.mode={mode}"]
    assert main() == 0
    print("loaded:", *sys.modules)
"""


@pytest.mark.slow
def test_only_mode_track_loads_what_it_tracks_with() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], check=True, capture_output=True, text=True
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("loaded:")]
    platform, track = ({*line.split()} for line in lines)
    assert platform & OF_TRACK == set()
    assert track & OF_TRACK == OF_TRACK
    assert track & OF_FEW == set()
