"""Who may speak for a process that is reached by a path in a folder."""

import os
from pathlib import Path

from firmware_runtime.hal.peer import trusted_users


def test_root_this_user_and_the_folders_owner_are_trusted_and_nobody_else(tmp_path: Path) -> None:
    assert trusted_users(tmp_path) == {0, os.geteuid(), tmp_path.stat().st_uid}
