"""A body's mass or inertia, its friction and its delay, out of a recording of a run.

Needs scipy (extra `tuning`) and is imported by no process that runs a robot.
"""
