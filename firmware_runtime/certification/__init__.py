"""The certificate that recordings replay to the same bits on several machines, and its page.

replaying   one recording, of either kind, replayed here: a `Finding`
leaves      the first field of two values that differs, floats to the bit
machine     what a machine computes with
certificate the findings of all machines, read, merged, judged
elsewhere   other interpreters of this computer, and of emulated ones
page        the same for people, a column a machine
"""
