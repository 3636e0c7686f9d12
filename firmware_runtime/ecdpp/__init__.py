"""E-CD++'s text files: events in, output lines out, coupled models.

Names in these files are compared without regard to case, as E-CD++ does: `in1` feeds port `In1`.
Where two names differ by case alone, the one written exactly so is meant. Comments begin with `#`,
`//` or `%` and end with the line; blank lines, spaces at either end and CRLF do not matter.
"""
