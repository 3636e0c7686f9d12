"""ChipName: its driver, its double, and what the command line knows about it."""
