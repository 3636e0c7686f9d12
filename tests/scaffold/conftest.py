from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def types_seen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What mypy keeps of the library, which every written package imports."""
    return tmp_path_factory.mktemp("mypy")
