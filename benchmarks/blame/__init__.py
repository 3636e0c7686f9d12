"""Whether the cause that the statistics name for a late activation is the one that made it late."""
