"""What a robot's package depends on that comes from no package index: a chip's package, for one.

pip notes where it installed a package from if that was a folder, a file or a repository
(direct_url.json, PEP 610). Such a one is taken along as it is here, even if an index has another of
that name. One with compiled parts is left to the index: what is here may not fit the target.
"""

import re
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from typing import Final

from firmware_runtime.host.deployment.package_wheel import OUR_OWN

_NAME: Final = re.compile(r"[A-Za-z0-9._-]+")


def with_local_dependencies(packages: Iterable[Distribution]) -> list[Distribution]:
    """These packages, and those they need, directly or not, that are from no index."""
    found: dict[str, Distribution] = {}
    left = list(packages)
    while left:
        package = left.pop(0)
        if found.setdefault(package.name, package) is package:
            left += _local(package)
    return list(found.values())


def _local(package: Distribution) -> Iterator[Distribution]:
    for required in package.requires or ():
        name, _, condition = required.partition(";")
        match = _NAME.match(name)
        if match is None or "extra" in condition or _normal(match[0]) == OUR_OWN:
            continue
        try:
            needed = distribution(match[0])
        except PackageNotFoundError:
            continue  # not for this computer; the index may have it for the target
        if needed.read_text("direct_url.json") is not None and _is_pure(needed):
            yield needed


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _is_pure(package: Distribution) -> bool:
    tags = re.findall(r"^Tag: (.+)$", package.read_text("WHEEL") or "", re.MULTILINE)
    return bool(tags) and all(tag.endswith("-none-any") for tag in tags)
