"""DEVStone on this kernel and on xdevs.py."""
