"""A picture of a model, or of one of its state diagrams, in either format."""

from collections.abc import Callable, Iterator
from typing import Final, Literal, TypeAlias

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.view.diagram import coupling_diagram, mermaid, state_graph

Form: TypeAlias = Literal["svg", "mmd"]

_DRAWERS: Final[dict[Form, tuple[Callable[[Component], str], Callable[[StateDiagram], str]]]] = {
    "svg": (coupling_diagram.coupling_diagram, state_graph.state_graph),
    "mmd": (mermaid.coupling_diagram, mermaid.state_graph),
}


def diagram(model: Component, state: str | None = None, form: Form = "svg") -> str:
    """The model's couplings, or the state graph of the component named by `state`.

    A name may leave out case and underscores, so `radar_controller` finds `radarController`; where
    several models share it, give the path from the top. Raises ConfigError if it fits no state
    diagram or several.
    """
    draw_couplings, draw_states = _DRAWERS[form]
    return draw_couplings(model) if state is None else draw_states(_find(model, state))


def _find(model: Component, name: str) -> StateDiagram:
    diagrams = list(_state_diagrams(model))
    found = [each for each in diagrams if _key(each.path) == _key(name)]
    found = found or [each for each in diagrams if _key(each.name) == _key(name)]
    if len(found) != 1:
        problem = "fits several models" if found else "no such model with a state diagram"
        known = ", ".join(each.path for each in found or diagrams)
        expected = f"expected one of {known}" if known else "there is none in this model"
        raise ConfigError(model.path, [f"{name!r}: {problem}; {expected}"])
    return found[0]


def _state_diagrams(model: Component) -> Iterator[StateDiagram]:
    if isinstance(model, StateDiagram):
        yield model
    elif isinstance(model, Coupled):
        for component in model.components.values():
            yield from _state_diagrams(component)


def _key(name: str) -> str:
    return name.replace("_", "").casefold()
