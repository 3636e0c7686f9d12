"""A folder of files that appears at once: what was interrupted or failed leaves nothing of it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_runtime.system.process_folder import own_folder


def nearest(folder: Path) -> Path:
    """The folder itself if it is there, or else the nearest place above it that is."""
    return next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """A place to gather files in; when the block ends well they are in `folder`, else nowhere.

    A folder that is there already keeps its other files; those of the same names are replaced,
    each at once. Raises OSError.
    """
    with own_folder(nearest(folder)) as own:
        gathered = own / "whole"
        gathered.mkdir()
        yield gathered
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists():
            for each in sorted(gathered.iterdir()):
                each.replace(folder / each.name)
        else:
            gathered.rename(folder)
