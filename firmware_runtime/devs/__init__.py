"""The formalism: Parallel and classic DEVS. No clock, no I/O, no threads."""
