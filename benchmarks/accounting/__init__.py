"""What accounting costs a step, in memory and at the start."""
