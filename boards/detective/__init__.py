"""The detective robot: a radar finds the target, two treads turn and drive the vehicle to it.

Source: Moallemi, Wainer et al.: Application of RT-DEVS in Military.
"""
