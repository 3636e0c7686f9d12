"""`run --plot FILE`: the picture of a run, where a board's rig can draw one."""

from pathlib import Path

from firmware_runtime.board.rig import Drawn
from firmware_runtime.errors import ConfigError
from firmware_runtime.runs.session import Session
from firmware_runtime.view.page_file import page_file_faults, write_page


def check_plot(session: Session, path: Path) -> None:
    """Refuse, before the run, a picture that cannot be drawn. Raises ConfigError."""
    faults = [f"--plot: {each}" for each in page_file_faults(path)]
    if not isinstance(session.hardware.rig, Drawn):
        faults.append("--plot: no picture of this run; expected doubles whose rig draws one")
    if faults:
        raise ConfigError(session.board.name, faults)


def write_plot(session: Session, path: Path, reason: str) -> None:
    """Draw what happened until the run was over, for that reason. Raises ConfigError.

    That is when the file cannot be written.
    """
    if isinstance(session.hardware.rig, Drawn):
        until, own = session.hardware.world_now(), session.robot.own_result()
        write_page(session.hardware.rig.draw(until, own, reason), path, "--plot")
