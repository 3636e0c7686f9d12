"""A chip's registers as its data sheet has them: the table, and the TOML file that it is read from.

Doubles go by it at run time, `scaffold` makes a new chip's package and its page of it.
"""
