"""What is done with many runs, off the robot: stages and continuity, experiments, identification, tuning, sweeps, gate."""
