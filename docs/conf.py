"""How Sphinx makes a site of this folder: `make docs`."""

from importlib.metadata import version as version_of

from firmware_runtime.links.dover.dover import DoverLink
from firmware_runtime.runs import session

project = "firmware-runtime"
author = "the firmware-runtime maintainers"
version = release = version_of("firmware-runtime")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
exclude_patterns = ["requirements.txt"]
default_role = "code"
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]

autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
suppress_warnings = ["docutils"]  # docstrings are plain text with drawings, not reStructuredText

html_theme = "furo"
html_title = f"firmware-runtime {release}"
html_show_sphinx = False


def setup(_app: object) -> None:
    """Let annotations be read that name what few runs load."""
    vars(session)["DoverLink"] = DoverLink
