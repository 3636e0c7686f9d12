"""Python expressions about models and ports whose names Python does not read as names.

A name in DEVS is any text without a dot: `brain.angle/rad > 0.5` is no division. Each such path
stands as a name of Python's while the text is parsed.
"""

import ast
import re
from collections.abc import Iterator
from keyword import iskeyword
from typing import Final

from firmware_runtime.recording.debugger.model_state import Models

_QUOTED: Final = "\"[^\"]*\"|'[^']*'"
_STAND_IN: Final = "_path_{}_"


def parsed(text: str, models: Models) -> ast.expr:
    """The expression, with the paths of models and ports as names. Raises SyntaxError, ValueError.

    What is in quotes is left as it is; of two paths that begin alike the longer one is meant.
    """
    paths = sorted(set(_odd_paths(models)), key=len, reverse=True)
    if not paths:
        return ast.parse(text, mode="eval").body
    any_of_them = "|".join(map(re.escape, paths))
    found = re.sub(
        rf"(?P<quoted>{_QUOTED})|(?<![\w.])(?P<path>{any_of_them})(?!\w)",
        lambda each: each["quoted"] or _STAND_IN.format(paths.index(each["path"])),
        text,
    )
    meant = {_STAND_IN.format(number): path for number, path in enumerate(paths)}
    expression = ast.parse(found, mode="eval").body
    for node in ast.walk(expression):
        if isinstance(node, ast.Name):
            node.id = meant.get(node.id, node.id)
    return expression


def _odd_paths(models: Models) -> Iterator[str]:
    """Paths of models and output ports in which a word is no name of Python's; numbers stay."""
    for path, component in models.by_path.items():
        for each in (path, *(f"{path}.{name}" for name in component.out_ports)):
            words = each.split(".")
            if not each.isdecimal() and not all(map(_is_name, words)):
                yield each


def _is_name(word: str) -> bool:
    return word.isidentifier() and not iskeyword(word)
