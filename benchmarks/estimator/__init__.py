"""What a step of the position estimator costs: `python -m benchmarks.estimator`."""
