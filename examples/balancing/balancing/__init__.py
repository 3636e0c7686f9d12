"""Balancing: a robot on two wheels that keeps itself upright, by an MPU-9250 and two motors."""
