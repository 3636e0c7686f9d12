"""What is imported before outputs are off: nothing that could wait until after."""

import subprocess
import sys

import pytest

NOT_NEEDED = ("numpy", "rclpy", "asyncio", "firmware_drivers.catalogue", "sim_doubles")
NOT_NEEDED_OF_OURS = (
    "devs.engine",
    "executive",
    "host.doctor",
    "links.bridge",
    "recording",
    "runs.guard",
    "runs.session",
    "runs.start",
    "statistics.trace_file",
    "view",
)


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_nothing_is_imported_that_only_a_run_needs(board: str) -> None:
    program = (
        "import sys\n"
        "from firmware_runtime.cli.main import parser\n"
        "from firmware_runtime.cli.chosen_board import chosen_board\n"
        f"words = ['safe-state', '{board}', '--doubles', '/nowhere']\n"
        "parsed = parser(words).parse_args(words)\n"
        "chosen_board(parsed.board, parsed.assignments)\n"
        "print('\\n'.join(sys.modules))"
    )
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    loaded = set(done.stdout.split())
    not_needed = {*NOT_NEEDED, *(f"firmware_runtime.{each}" for each in NOT_NEEDED_OF_OURS)}
    assert "firmware_runtime.runs.safe_state" in loaded
    assert loaded & not_needed == set()
