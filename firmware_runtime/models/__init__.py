"""Device-free atomic models for any robot: PID, delay, and diagrams written as a state table."""
