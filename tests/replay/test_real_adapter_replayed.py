"""A run on a real `/dev/i2c-N`, doubles behind the kernel's own USB adapter, is its replay."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sim_doubles.usbip.host_controller import CONTROLLER, MODULES
from tests.support.replayed import check_identical
from tests.support.waiting import PATIENCE_S

pytestmark = [
    pytest.mark.slow,
    pytest.mark.real_time,
    pytest.mark.skipif(
        os.geteuid() != 0 or not CONTROLLER.exists(),
        reason=f"no {CONTROLLER}; expected root, and a kernel with the modules of Debian's package "
        f"linux-image-amd64 after `modprobe -a {' '.join(MODULES)}`",
    ),
]
COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_a_run_on_the_kernels_bus_is_its_replay(tmp_path: Path, board: str) -> None:
    words = ["doubles", "usbip", board, "--socket", str(tmp_path / "doubles")]
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True) as doubles:
        try:
            assert doubles.stdout is not None
            device = next(each.split()[-1] for each in doubles.stdout if " is /dev/" in each)
            ended = subprocess.run(
                [*COMMAND, "run", board, "--set", f"buses.i2c1.device={device}", "--for", "2"],
                env={**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)},
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=False,
            )
        finally:
            doubles.terminate()
            doubles.wait(PATIENCE_S)
    assert ended.returncode == 0, ended.stderr
    check_identical(tmp_path / f"{board}.recording")
