"""`run --plot FILE`: the picture of a run, where a board's bench can draw one."""

from pathlib import Path

from firmware_runtime.cli.session import Session
from firmware_runtime.errors import BoardError
from sim_doubles.benches.bench import Drawn
from sim_doubles.worlds.arena_picture_file import write_picture

ENDINGS = (".svg", ".png")


def check_plot(session: Session, path: Path) -> None:
    """Refuse, before the run, a picture that cannot be made. Raises BoardError."""
    faults = []
    if not isinstance(session.bench, Drawn):
        faults.append("--plot: there is no picture of this run; expected the detective on doubles")
    if path.suffix not in ENDINGS:
        faults.append(f"--plot: {path} ends in {path.suffix!r}, expected .svg or .png")
    if not path.absolute().parent.is_dir():
        faults.append(f"--plot: {path.parent} is no directory, expected one that can be written")
    if faults:
        raise BoardError(session.board.name, faults)


def write_plot(session: Session, path: Path) -> None:
    """Draw what happened so far. Raises BoardError when the file cannot be written."""
    if not isinstance(session.bench, Drawn):
        return
    try:
        write_picture(path, session.bench.draw(session.world_now()))
    except (OSError, ValueError) as error:
        raise BoardError(session.board.name, [f"--plot: {error}"]) from error
