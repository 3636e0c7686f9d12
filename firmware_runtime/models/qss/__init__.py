"""Quantized state systems: continuous systems as DEVS models, from equations or in blocks.

One engine runs both: a `System` becomes one atomic model, and so does each block of a diagram,
which is a system of one part. `solve` runs a system. A wire carries a `Segment`, a polynomial in
time that holds until the next one is sent.
"""

from firmware_runtime.models.qss.blocks import (
    LIQSS2,
    QSS1,
    QSS2,
    QSS3,
    Crossing,
    Function,
    Gain,
    Hysteresis,
    Integrator,
    Product,
    Quantizer,
    SampleHold,
    Sine,
    Sum,
    Switch,
)
from firmware_runtime.models.qss.bound import error_bound
from firmware_runtime.models.qss.model import Simulation, SystemModel, solve
from firmware_runtime.models.qss.sampling import Hold, SegmentDelay, VariableDelay
from firmware_runtime.models.qss.segment import Segment
from firmware_runtime.models.qss.sources import (
    Constant,
    FromFile,
    Pulse,
    Ramp,
    Samples,
    Square,
    Step,
)
from firmware_runtime.models.qss.system import System, When

__all__ = [
    "LIQSS2",
    "QSS1",
    "QSS2",
    "QSS3",
    "Constant",
    "Crossing",
    "FromFile",
    "Function",
    "Gain",
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
