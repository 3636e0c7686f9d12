"""Device-free atomic models, for any robot."""
