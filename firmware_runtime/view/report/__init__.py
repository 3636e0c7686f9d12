"""One self-contained page of a run's timing, made from a copy of its statistics file."""
