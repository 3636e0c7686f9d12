"""Wheels that an environment needs beside the system's packages.

An environment sees those, such as the ones that are from Debian alone. What the system has and what
suffices is left to it, as pip does: a second numpy breaks what was built with the first.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from packaging.requirements import Requirement
from packaging.version import InvalidVersion

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.package_wheel import metadata_of
from firmware_runtime.host.deployment.target import Target
from firmware_runtime.system.packages import normal_name


class _Wheel(NamedTuple):
    file: Path
    needs: list[Requirement]


def needed(
    wheels: Iterable[Path], ours: Sequence[Path], extras: Iterable[str], target: Target
) -> list[Path]:
    """Return the wheels that the target needs for `ours`, which are among them.

    `extras` are those of the first of ours. Raises DeploymentError where one is missing.
    """
    known: dict[str, _Wheel] = {}
    for file in wheels:
        name, needs = metadata_of(file)
        known[normal_name(name)] = _Wheel(file, [*map(Requirement, needs)])
    first, *others = (normal_name(metadata_of(file)[0]) for file in ours)
    roots = [Requirement(f"{first}[{','.join(extras)}]"), *map(Requirement, others)]
    system = target.system_packages
    asked = _reachable(roots, known, target, frozenset())
    left_to_it = frozenset(
        name
        for name, requirements in asked.items()
        if name in system and name not in {first, *others} and _suffices(system[name], requirements)
    )
    asked = _reachable(roots, known, target, left_to_it)
    if missing := sorted(asked.keys() - known.keys() - left_to_it):
        raise DeploymentError(
            f"no wheel of {', '.join(missing)}", expected=f"one for {target.platform}"
        )
    return [known[name].file for name in sorted(asked.keys() - left_to_it)]


def _reachable(
    roots: Iterable[Requirement],
    known: Mapping[str, _Wheel],
    target: Target,
    left_to_it: frozenset[str],
) -> dict[str, list[Requirement]]:
    """Everything that is required there, directly or not, by the names of the packages."""
    asked: dict[str, list[Requirement]] = {}
    left = list(roots)
    while left:
        requirement = left.pop()
        name = normal_name(requirement.name)
        if requirement in asked.setdefault(name, []):
            continue
        asked[name].append(requirement)
        if name in known and name not in left_to_it:
            left += [each for each in known[name].needs if _holds(each, requirement, target)]
    return asked


def _holds(needed: Requirement, by: Requirement, target: Target) -> bool:
    marker = needed.marker
    return marker is None or any(
        marker.evaluate({**target.markers, "extra": extra}) for extra in by.extras or {""}
    )


def _suffices(version: str, requirements: Iterable[Requirement]) -> bool:
    try:
        return all(each.specifier.contains(version, prereleases=True) for each in requirements)
    except InvalidVersion:
        return False
