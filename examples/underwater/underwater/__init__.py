"""Devices of your own: a depth gauge, a flow meter and a winch, none of which exists."""
