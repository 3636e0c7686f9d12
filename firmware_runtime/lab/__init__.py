"""The laboratory: what is done with many runs, off the robot.

Stages and continuity, experiments, identification, tuning, sweeps, gate.
"""
