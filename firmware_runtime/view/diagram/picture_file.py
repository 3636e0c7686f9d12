"""Writes a picture to a file: SVG as it is, PNG through resvg, which the extra `plot` brings."""

from importlib import import_module
from pathlib import Path
from typing import Any, Final

from firmware_runtime.system.packages import install_command

__all__ = ["require_renderer", "write_picture"]

_PNG_ZOOM: Final = 2


def write_picture(path: Path, svg: str) -> None:
    """Write an SVG's text to a file whose name ends in .svg or .png; the PNG shows light colours.

    Raises ValueError for another ending, or for .png without the extra; OSError as files do.
    """
    if path.suffix == ".svg":
        path.write_text(svg, encoding="utf-8")
    elif path.suffix == ".png":
        path.write_bytes(_png(svg))
    else:
        raise ValueError(f"picture {path}: ends in {path.suffix!r}, expected .svg or .png")


def require_renderer(path: Path) -> None:
    """Raise ValueError if this picture needs what is not installed."""
    if path.suffix == ".png":
        _renderer()


def _png(svg: str) -> bytes:
    return bytes(_renderer().svg_to_bytes(svg_string=svg, zoom=_PNG_ZOOM))


def _renderer() -> Any:  # noqa: ANN401 -- a module that need not be there
    try:
        return import_module("resvg_py")
    except ImportError as error:
        raise ValueError(
            f"picture: PNG needs resvg, expected the extra plot: {install_command('plot')}; "
            "SVG needs nothing"
        ) from error
