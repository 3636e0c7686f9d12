"""A generator of jobs, and a buffer before a processor: Figure 1 of the paper as a model that runs.

Source: "Application of RT-DEVS in Military", section 2 and Figure 1.
"""
