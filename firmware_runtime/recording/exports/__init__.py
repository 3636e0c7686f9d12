"""A recording for other programs: MCAP with messages of ROS 2, or a table of its ports."""
