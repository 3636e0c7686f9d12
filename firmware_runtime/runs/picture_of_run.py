"""`run --plot FILE`: the picture of a run, where a board's bench can draw one."""

from pathlib import Path

from firmware_runtime.board.rig import Drawn
from firmware_runtime.errors import ConfigError
from firmware_runtime.runs.session import Session
from firmware_runtime.view.diagram.picture_file import require_renderer, write_picture

ENDINGS = (".svg", ".png")


def check_plot(session: Session, path: Path) -> None:
    """Refuse, before the run, a picture that cannot be drawn. Raises ConfigError."""
    faults = []
    if not isinstance(session.hardware.rig, Drawn):
        faults.append("--plot: no picture of this run; expected doubles whose rig draws one")
    if path.suffix not in ENDINGS:
        faults.append(f"--plot: {path} ends in {path.suffix!r}, expected .svg or .png")
    try:
        require_renderer(path)
    except ValueError as error:
        faults.append(f"--plot: {error}")
    if faults:
        raise ConfigError(session.board.name, faults)


def write_plot(session: Session, path: Path, reason: str) -> None:
    """Draw what happened until the run was over, for that reason. Raises ConfigError.

    That is when the file cannot be written.
    """
    if not isinstance(session.hardware.rig, Drawn):
        return
    until, own = session.hardware.world_now(), session.robot.own_result()
    try:
        write_picture(path, session.hardware.rig.draw(until, own, reason))
    except (OSError, ValueError) as error:
        raise ConfigError(session.board.name, [f"--plot: {error}"]) from error
