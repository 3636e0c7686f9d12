"""What the fixtures of `sim_doubles.pytest_plugin` are made of."""
