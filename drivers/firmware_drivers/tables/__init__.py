"""Tables of a board file for devices that come on different chips, one module a kind of device.

Each table is a variant of a union (`firmware_runtime.board.variants`) and knows all that a board
needs of its chip: the driver, where it is, and what it costs on the bus. A board puts the union
into its settings and asks the table; it need not know which chip was chosen. The doubles of the
same tables are in `sim_doubles.rigs.devices`.
"""
