"""Every chip with a driver: how it is recognised on a bus, how it is read and how it is moved.

`firmware_drivers.catalogue.table` finds ours and those of other packages by entry point.
"""
