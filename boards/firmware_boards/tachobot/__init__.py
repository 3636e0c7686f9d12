"""TachoBot: a hovering platform with eight propellers in four thrust pairs and one more to lift it.

Source: Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), Winter Simulation Conference 2018.
"""
