"""docs/qss.md shows systems and what they print: they must."""

import pytest

from tests.support.pages import Example, examples, printed

EXAMPLES = examples("qss.md")


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_every_system_prints_what_the_page_says(example: Example) -> None:
    assert printed(example.program) == example.output


def test_the_page_has_its_systems() -> None:
    assert len(EXAMPLES) == 6
