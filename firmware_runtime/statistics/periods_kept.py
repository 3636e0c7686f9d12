"""Models whose behaviour contradicts the period that they state, by name.

A shift of the phase now and then is none: a bring-up that was repeated, a chip that was silent. One
in a tenth of the activations is.
"""

from collections.abc import Iterator, Mapping
from typing import Any

_LEAST = 3
_SHARE = 10


def not_keeping(statistics: Mapping[str, Any]) -> list[str]:
    """Paths of the models that do not come back at their period, of statistics as JSON."""
    return [
        path
        for path, model in statistics["models"].items()
        if model["irregular"] >= _LEAST and model["irregular"] * _SHARE > model["run"]
    ]


def periods_not_kept(statistics: Mapping[str, Any]) -> Iterator[str]:
    """A sentence on each of them."""
    for path in not_keeping(statistics):
        model = statistics["models"][path]
        yield (
            f"{path} states a period of {model['period_us'] / 1000:g} ms and does not keep it: "
            f"{model['irregular']} of {model['run']} activations came at another time, the last "
            f"{model['returned_after_us'] / 1000:g} ms after the one before"
        )
