"""How Sphinx makes a site of this folder: `make docs`."""

from importlib.metadata import version as version_of

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
