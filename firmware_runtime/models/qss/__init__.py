"""Quantized state systems: continuous systems as DEVS models, in integrators and blocks.

A block diagram is a coupled model of these blocks; a `System` makes one from equations, and `solve`
runs it. A wire carries a `Segment`, a polynomial in time that holds until the next one is sent.
"""

from firmware_runtime.models.qss.assignment import Assignment, Held
from firmware_runtime.models.qss.bound import error_bound
from firmware_runtime.models.qss.crossing import Crossing
from firmware_runtime.models.qss.function import Function
from firmware_runtime.models.qss.integrator import Integrator
from firmware_runtime.models.qss.linear import Gain, Product, Sum
from firmware_runtime.models.qss.liqss2 import LIQSS2
from firmware_runtime.models.qss.model import SystemModel
from firmware_runtime.models.qss.qss1 import QSS1
from firmware_runtime.models.qss.qss2 import QSS2
from firmware_runtime.models.qss.qss3 import QSS3
from firmware_runtime.models.qss.relays import Hysteresis, Quantizer, Switch
from firmware_runtime.models.qss.sampling import Hold, SampleHold, SegmentDelay, VariableDelay
from firmware_runtime.models.qss.segment import Segment
from firmware_runtime.models.qss.solve import Simulation, solve
from firmware_runtime.models.qss.sources import (
    Constant,
    FromFile,
    Pulse,
    Ramp,
    Samples,
    Sine,
    Square,
    Step,
)
from firmware_runtime.models.qss.system import System
from firmware_runtime.models.qss.when import When

__all__ = [
    "LIQSS2",
    "QSS1",
    "QSS2",
    "QSS3",
    "Assignment",
    "Constant",
    "Crossing",
    "FromFile",
    "Function",
    "Gain",
    "Held",
    "Hold",
    "Hysteresis",
    "Integrator",
    "Product",
    "Pulse",
    "Quantizer",
    "Ramp",
    "SampleHold",
    "Samples",
    "Segment",
    "SegmentDelay",
    "Simulation",
    "Sine",
    "Square",
    "Step",
    "Sum",
    "Switch",
    "System",
    "SystemModel",
    "VariableDelay",
    "When",
    "error_bound",
    "solve",
]
