"""kill -9 of each part of a linked robot: how soon its outputs are off, and for how long."""
