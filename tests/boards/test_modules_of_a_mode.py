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


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "expected"), [("platform", set()), ("track", OF_TRACK)])
def test_only_mode_track_loads_what_it_tracks_with(mode: str, expected: set[str]) -> None:
    words = ["run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1"]
    program = (
        "import sys\n"
        "from firmware_runtime.cli.main import main\n"
        f"sys.argv[1:] = {[*words, '--set', f'controller.mode={mode}']}\n"
        "assert main() == 0\n"
        "print('loaded:', *sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    loaded = set(done.stdout.split("loaded:")[1].split())
    assert loaded & OF_TRACK == expected
    assert loaded & OF_FEW == set()
