"""The detective robot's missions, wherever its target stands."""
