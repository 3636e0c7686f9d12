"""The whole state of a running robot: captured as bytes, compared, and set back in place.

    known (objects, numbered)  ->  columns (what they hold)  ->  pickled  ->  bytes

It knows nothing of recordings. What an object consists of is in `layouts`; what was made after the
robot was built is kept by value (`later`, `making`).
"""
