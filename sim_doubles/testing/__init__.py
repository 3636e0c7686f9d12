"""Parts of the fixtures of `sim_doubles.pytest_plugin`."""
