"""Whether a reader of statistics makes the loop late."""
