"""Starts the node of a robot from a ROS 2 workspace."""
