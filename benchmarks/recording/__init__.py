"""What it costs to record a run at its edge."""
