"""An object that holds whatever a test of states puts into it."""

from typing import Any


class Node:
    """Whatever a test puts into it."""

    def __init__(self, **fields: Any) -> None:  # noqa: ANN401 -- any state
        vars(self).update(fields)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 -- any state
        raise AttributeError(name)

    def __setattr__(self, name: str, value: Any) -> None:  # noqa: ANN401 -- any state
        vars(self)[name] = value

    def act(self) -> str:
        return "acted"
