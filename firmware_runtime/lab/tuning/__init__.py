"""Gains of a PID loop: its margins, its steps, and the best gains for an identified plant.

Needs scipy (extra `tuning`) where it searches, and is imported by no process that runs a robot.
"""
