"""The state of a running robot as plain values: captured as bytes, compared, and set back in place.

    walk (objects that have state)  ->  rows (what is not as built)  ->  plain forms  ->  bytes

It knows nothing of recordings. A file's state is data: what values it may hold, and how they are
made, is in `recording.values` and `recording.records`.
"""
