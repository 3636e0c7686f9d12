import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def types_seen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What mypy keeps of the library, which every written package imports; of all workers."""
    base = tmp_path_factory.getbasetemp()
    return (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "mypy"
