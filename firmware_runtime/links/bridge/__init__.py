"""Ports of a running robot over UDP, carried by a process of its own."""
