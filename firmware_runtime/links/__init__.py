"""Ports of a running robot's model for other processes: datagrams on a Unix socket, and bridges."""
