"""What tests of campaigns have in common: missions without what was known of them before."""

from collections.abc import Iterator

import pytest

from firmware_runtime.lab.campaign.healthy import healthy
from firmware_runtime.lab.campaign.space import space_of


@pytest.fixture
def anew() -> Iterator[None]:
    """Run healthy missions of a test by itself: it has a mistake of its own."""
    healthy.cache_clear()
    space_of.cache_clear()
    yield
    healthy.cache_clear()
    space_of.cache_clear()
