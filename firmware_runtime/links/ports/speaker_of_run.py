"""Which process may speak for a run: the one that its statistics name, and no other.

What listens beside the statistics may be anything where others can write to the folder, and a run
that hangs cannot object. So the process at the other end of a connection, as the kernel says, has
to be the one that writes the statistics; its user, like theirs, is root, this user or the one to
whom the folder belongs, as that of a service does.
"""

from pathlib import Path

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.hal.peer import Credentials, trusted_users
from firmware_runtime.statistics.file import STATISTICS, driver_of


def why_not_of_run(by: Credentials, statistics: Path) -> str:
    """Why a process does not speak for the run with these statistics, empty if it does."""
    try:
        owner, trusted = statistics.stat().st_uid, trusted_users(statistics.parent)
        with STATISTICS.opened(statistics) as file:
            process = driver_of(file).writer.pid
    except (OSError, StatisticsFileError) as error:
        return f"process {by.process} listens, and no statistics name it ({error})"
    if owner not in trusted:
        return f"{statistics} belongs to user {owner}, and so may be anybody's"
    if by.process != process:
        return f"process {by.process} listens, and the run is process {process}"
    if by.user not in trusted:
        return f"process {by.process} is user {by.user}'s, and so may be anybody's"
    return ""
