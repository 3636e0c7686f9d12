"""Stand-ins for the world at the edge: chips that answer byte by byte, plants that move.

A double has two faces. The bus face speaks the chip's own bytes, acknowledges and refuses as the
datasheet says; the world face speaks SI units to a plant. Time is injected and nothing sleeps: what
a chip does by itself is evaluated when somebody looks. What the real chip would not take as meant
is kept in `warnings`. A double never looks at a driver: each transcribes the datasheet on its own,
so that a wrong address shows.
"""
