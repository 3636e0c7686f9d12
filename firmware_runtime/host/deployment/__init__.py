"""Brings the program to another computer, over ssh or as a Debian package.

Both carry every wheel that is needed, made or chosen here for the target's Python and processor, so
that the target needs neither a compiler nor the network.
"""
