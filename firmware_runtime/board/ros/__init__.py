"""Topics and message types of a board's ports, by their Python types; no ROS is needed for it."""
