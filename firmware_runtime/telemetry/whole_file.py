"""Files that are replaced at once: whoever reads one finds it whole, or the one before."""

import os
from pathlib import Path


def replace_file(path: Path, content: bytes, mode: int | None = None) -> None:
    """Put content there, with these permissions if any are stated. Raises OSError.

    What could not be finished is removed.
    """
    unfinished = path.parent / f".{path.name}.{os.getpid()}"
    try:
        unfinished.write_bytes(content)
        if mode is not None:
            unfinished.chmod(mode)
        unfinished.replace(path)
    except OSError:
        unfinished.unlink(missing_ok=True)
        raise
