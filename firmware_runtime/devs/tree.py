"""A model as people read it: names indented by depth, classes, ports with types, couplings."""

from collections.abc import Iterator

from firmware_runtime.devs.component import Component, check_constructed
from firmware_runtime.devs.coupled import Coupled


def tree(root: Component, *, couplings: bool = True) -> str:
    """One line a component, a port and (on request) a coupling, in order of declaration."""
    check_constructed(root)
    return "\n".join(_lines(root, "", couplings=couplings))


def _lines(component: Component, indent: str, *, couplings: bool) -> Iterator[str]:
    yield f"{indent}{component.name} ({type(component).__name__})"
    inner = f"{indent}  "
    for port in component.in_ports.values():
        yield f"{inner}-> {port.name}: {port.type.__name__}"
    for output in component.out_ports.values():
        yield f"{inner}{output.name}: {output.type.__name__} ->"
    if isinstance(component, Coupled):
        for child in component.components.values():
            yield from _lines(child, inner, couplings=couplings)
        if couplings:
            for source, destination in component.couplings:
                ends = (_below(end.path, component) for end in (source, destination))
                yield f"{inner}{' -> '.join(ends)}"


def _below(path: str, component: Component) -> str:
    return path.removeprefix(f"{component.path}.")
