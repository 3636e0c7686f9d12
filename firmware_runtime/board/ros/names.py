"""Names as ROS allows them."""

import re


def ros_name(text: str) -> str:
    """The text as a name in ROS: letters, digits and underscores, no digit first."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return f"_{name}" if name[:1].isdigit() else name


def node_name(board: str) -> str:
    """The name of a board's node, and of its namespace."""
    name = board.replace("-", "_")
    return f"robot_{name}" if name[0].isdigit() else name
