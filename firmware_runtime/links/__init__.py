"""Ports of a running robot's model for other processes.

The run has a Unix datagram socket (`ports_socket`) that takes values in and sends values out, and
never waits for a reader. `bridge` and `broadcast` are processes of their own that carry them on to
UDP peers.
"""
