"""Values into the ports of a running model, and what its ports send, over a Unix socket."""
