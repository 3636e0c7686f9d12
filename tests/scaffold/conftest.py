from pathlib import Path

import pytest

from firmware_runtime.host.scaffold.package import write_robot
from tests.support.made_once import made_once
from tests.support.written_package import as_installed


@pytest.fixture(scope="session")
def types_seen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What mypy keeps of the library, which every written package imports; read once for all."""

    def read(into: Path) -> Path:
        write_robot("seen", into / "seen")
        types = as_installed(into / "seen", into / "site").types(into / "cache", "seen", "tests")
        assert types.returncode == 0, types.stdout
        return into / "cache"

    return made_once(tmp_path_factory, "types_seen", read)
