"""Every chip with a driver: how it is recognised on a bus, how it is read and how it is moved.

The one table is `drivers.catalogue.table`. A chip is called there as a board names it.
"""
