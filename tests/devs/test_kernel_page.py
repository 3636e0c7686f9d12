"""docs/kernel.md shows a program and what it prints: it must."""

from tests.support.pages import examples, printed


def test_the_example_prints_what_the_page_says() -> None:
    (example,) = examples("kernel.md")
    assert printed(example.program) == example.output
