"""Brings the program to another computer, over ssh.

Every wheel that is needed goes along, made or chosen here for the target's Python and processor, so
that the target needs neither a compiler nor the network.
"""
