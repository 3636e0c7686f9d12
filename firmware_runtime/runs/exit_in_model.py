"""A model that ends the program would end a run without a word: it is a bug of that model."""

from collections.abc import Iterator
from contextlib import contextmanager

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.model_errors import ModelError


@contextmanager
def quitting_is_a_bug(model: Component) -> Iterator[None]:
    """Raise ModelError for a SystemExit from a run whose signals are taken: a model raised it."""
    try:
        yield
    except SystemExit as error:
        found = f"{model.path}: a model raised SystemExit({error.code!r})"
        raise ModelError(found, expected="none: it would end the program") from error
