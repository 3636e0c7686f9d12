"""Whose files are read: one's own, root's and the service's.

Anybody may put a file or a folder where it is looked for, such as among temporary files, and what a
run leaves says which code to load and what to feed it.
"""

import os
from pathlib import Path
from typing import Final

SERVICE_USER: Final = "firmware-runtime"


def foreign_owner(status: os.stat_result) -> str | None:
    """Name of the user who owns it; None for oneself, root, and the user of the service."""
    if status.st_uid in (0, os.geteuid()):
        return None
    from pwd import getpwuid  # noqa: PLC0415 -- seldom comes to this

    try:
        name = getpwuid(status.st_uid).pw_name
    except KeyError:
        return f"user {status.st_uid}"
    return None if name == SERVICE_USER else name


def owner_of_folder(folder: Path) -> str | None:
    """As `foreign_owner`, of a folder, or of that which it would be made in."""
    for each in (folder, folder.parent):
        try:
            return foreign_owner(each.stat())
        except OSError:
            continue
    return None


def refused(path: Path, owner: str) -> str:
    """Why a file or folder is not read, and how one gets it all the same."""
    expected = "expected one's own, root's or the service's; a copy of one's own can be read"
    return f"{path} belongs to {owner}; {expected}"
