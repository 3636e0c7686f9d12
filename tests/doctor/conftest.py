import pytest

from firmware_runtime.host.doctor.registry import GROUPS
from tests.support.fake_machines import Examine


@pytest.fixture
def examine() -> Examine:
    """Carries out one check, by its id, and lets its errors through."""
    by_id = {check.id: check for checks in GROUPS.values() for check in checks}
    return lambda name, machine: by_id[name].examine(machine)
