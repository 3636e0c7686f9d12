"""A board: entry points, settings, checks, bus budget, and the robot it builds."""
