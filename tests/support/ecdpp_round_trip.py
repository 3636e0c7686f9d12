"""A model as a file, as Python source and back, for tests."""

from pathlib import Path

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import AnyPort


def described(model: Component) -> list[str]:
    """Every port with its type, and every coupling, at every level."""
    ports: list[AnyPort] = [*model.in_ports.values(), *model.out_ports.values()]
    lines = [f"{type(port).__name__} {port.path} {port.type.__name__}" for port in ports]
    if isinstance(model, Coupled):
        lines += [f"{source.path} -> {end.path}" for source, end in model.couplings]
        for component in model.components.values():
            lines += described(component)
    return lines


def executed(source: str, path: Path, name: str) -> Coupled:
    """What the class of that name in the source makes."""
    found: dict[str, object] = {"__name__": path.stem}
    exec(compile(source, str(path), "exec"), found)  # noqa: S102 -- source that was just made
    made = found[name]
    assert isinstance(made, type)
    model = made()
    assert isinstance(model, Coupled)
    return model
