"""What it costs to capture the state of a robot."""
