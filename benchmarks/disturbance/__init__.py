"""A robot's end of a link while it is flooded, and while its controller is killed."""
