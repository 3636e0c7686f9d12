"""A rig's doubles in another process: buses and ports that reach it over a Unix socket."""
