"""How long a value takes over ROS 2, and where."""
