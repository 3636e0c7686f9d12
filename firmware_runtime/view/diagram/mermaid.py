"""The same pictures as text for Mermaid, which places boxes and arrows by itself.

Mermaid's state diagrams have one kind of arrow; `?` and `!` in the labels mark inputs and outputs.
"""

from collections.abc import Iterator

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.view.diagram.diagram_look import arrow_labels, duration_text

INDENT = "    "
_ONE_LINE = 1_000_000


def coupling_diagram(model: Component) -> str:
    """The model's couplings as a flow chart; ports of coupled models are nodes of their own."""
    lines = ["flowchart LR", *(INDENT + line for line in _nodes(model))]
    lines += (INDENT + line for line in _wires(model))
    return "\n".join(lines) + "\n"


def state_graph(model: StateDiagram) -> str:
    """The model's table as a state diagram."""
    identifiers = {state.name: f"s{number}" for number, state in enumerate(model.states)}
    lines = ["stateDiagram-v2", f"{INDENT}[*] --> s0"]
    for name, identifier in identifiers.items():
        duration = duration_text(model.durations[name])
        lines.append(f"{INDENT}{identifier} : {_plain(name)} ({duration})")
    for state in model.states:
        for arrow in state.arrows:
            label = _plain(" ".join(arrow_labels([arrow], _ONE_LINE)))
            ends = f"{identifiers[state.name]} --> {identifiers[arrow.to]}"
            lines.append(f"{INDENT}{ends}" + (f" : {label}" if label else ""))
    return "\n".join(lines) + "\n"


def _nodes(model: Component) -> Iterator[str]:
    """A box for an atomic model; for a coupled one a frame with its ports and components."""
    if not isinstance(model, Coupled):
        yield f'{_identifier(model.path)}["{_plain(model.name)}"]'
        return
    yield f'subgraph {_identifier(model.path)}["{_plain(model.name)}"]'
    ports: list[AnyPort] = [*model.in_ports.values(), *model.out_ports.values()]
    for port in ports:
        yield f'{INDENT}{_identifier(port.path)}(["{_plain(port.name)}"])'
    for component in model.components.values():
        yield from (INDENT + line for line in _nodes(component))
    yield "end"


def _wires(model: Component) -> Iterator[str]:
    if not isinstance(model, Coupled):
        return
    for source, end in model.couplings:
        ports = [port.name for port in (source, end) if not isinstance(port.owner, Coupled)]
        label = f'|"{_plain(" to ".join(ports))}"|' if ports else ""
        yield f"{_end(source)} -->{label} {_end(end)}"
    for component in model.components.values():
        yield from _wires(component)


def _end(port: AnyPort) -> str:
    """Return where a wire ends: at an atomic model, or at a coupled one's port."""
    return _identifier(port.path if isinstance(port.owner, Coupled) else port.owner.path)


def _identifier(path: str) -> str:
    """A path as a word that Mermaid takes for a name and for no keyword."""
    return "".join(
        letter
        if letter.isascii() and (letter.isalnum() or letter in "_.")
        else f"u{ord(letter):x}_"
        for letter in f"model.{path}"
    ).replace(".", "__")


def _plain(text: str) -> str:
    """A text without the letters that mean something to Mermaid, which it writes by number."""
    special = {'"', "#", ";", ":", "<", ">"}
    return "".join(f"#{ord(letter)};" if letter in special else letter for letter in text)
