"""The detective robot: a radar finds the target, two treads turn and drive the vehicle to it.

Source: "Application of RT-DEVS in Military", sections 3.1 to 3.3. README.md says what the paper
leaves open or contradicts, and how it was settled.
"""
