"""Whether a file that a user named can be written, without making or changing it."""

import os
import stat
from pathlib import Path


def why_not_writable(path: Path) -> str | None:
    """Why no file can be opened there to be written, in words; None if it seems to be possible."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return _why_not_made(Path(os.path.realpath(path)).parent)
    except OSError as error:
        return error.strerror or type(error).__name__
    except ValueError:
        return "a null character in its name"
    if stat.S_ISDIR(mode):
        return "it is a folder"
    return None if os.access(path, os.W_OK) else "no right to write it"


def _why_not_made(folder: Path) -> str | None:
    """Why no file can be made in a folder."""
    if not folder.exists():
        return f"there is no folder {folder}"
    if not folder.is_dir():
        return f"{folder} is no folder"
    return None if os.access(folder, os.W_OK | os.X_OK) else f"no right to write into {folder}"
