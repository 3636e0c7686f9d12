"""Runs DEVS models as the firmware of a robot: formalism, executive, hardware words, statistics.

This is the front door. What a user needs to write and run a model can be imported from here:

    from firmware_runtime import SECOND, Atomic, Coupled, VirtualClock, run

Each name is loaded from the room where it is defined when it is first asked for, so importing this
package costs next to nothing and no name pays for another. Below these names there are the rooms
(`devs`, `models`, `hal`, `executive`, ...); each says what it is for. Only the names in `__all__`
are kept stable.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from firmware_runtime.board.definition import BoardDefinition
    from firmware_runtime.board.faults import Device
    from firmware_runtime.board.robot import Ending, Lines, Robot
    from firmware_runtime.board.settings import BoardSettings
    from firmware_runtime.devs.atomic import Atomic
    from firmware_runtime.devs.classic import ClassicSimulator
    from firmware_runtime.devs.component import Component
    from firmware_runtime.devs.coupled import Coupled
    from firmware_runtime.devs.model_errors import (
        CouplingError,
        IllegitimateModel,
        ModelError,
        ModelFailure,
        ModelTimeError,
        OutputChangedState,
        PortTypeError,
        SelectError,
        SentOutsideOutput,
        TimeAdvanceError,
    )
    from firmware_runtime.devs.ports import InPort, Listening, OutPort
    from firmware_runtime.devs.simulator import Simulator
    from firmware_runtime.devs.time import (
        MICROSECOND,
        MILLISECOND,
        NANOSECOND,
        NEVER,
        SECOND,
        format_time,
        seconds,
    )
    from firmware_runtime.devs.trace import trace
    from firmware_runtime.devs.tree import tree
    from firmware_runtime.ecdpp.atomic_class import AtomicClass
    from firmware_runtime.errors import (
        ConfigError,
        FirmwareRuntimeError,
        SettingError,
        StatisticsFileError,
        UnknownName,
    )
    from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
    from firmware_runtime.executive.configuration import Configuration
    from firmware_runtime.executive.deadlines import PathDeadline
    from firmware_runtime.executive.executive import Executive
    from firmware_runtime.executive.inbox import Inbox, Source
    from firmware_runtime.executive.outcome import Outcome
    from firmware_runtime.executive.policy import ActivationPolicy
    from firmware_runtime.executive.process import ProcessSettings
    from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction
    from firmware_runtime.hal.i2c import I2cBus, Message
    from firmware_runtime.hal.interlock import EnableLine, Interlock, always_enabled
    from firmware_runtime.hal.serial import SerialPort
    from firmware_runtime.hal.strike import Strike
    from firmware_runtime.hal.wire_errors import (
        AddressInUse,
        ArbitrationLost,
        BusAbsent,
        BusFault,
        BusInUse,
        BusTimeout,
        Fault,
        HalError,
        Implausible,
        NoAcknowledge,
        NotReady,
        PortClosed,
        Runaway,
        Stuck,
        WrongDevice,
    )
    from firmware_runtime.models.delay import Delay
    from firmware_runtime.models.motion import Motion
    from firmware_runtime.models.pid import Pid, PidGains
    from firmware_runtime.models.plant import SecondOrderPlant
    from firmware_runtime.models.smith_predictor import SmithPredictor
    from firmware_runtime.models.state_diagram import StateDiagram
    from firmware_runtime.models.state_table import Arrow, State, StateTableError
    from firmware_runtime.recording.exports.recorded_run import RecordedRun, open_recording
    from firmware_runtime.runs.model_alone import open_model, run
    from firmware_runtime.runs.open_board import OpenBoard, open_board
    from firmware_runtime.runs.open_run import OpenRun, RunResult
    from firmware_runtime.statistics.figures import Figures, ModelFigures
    from firmware_runtime.statistics.file_header import RunState
    from firmware_runtime.statistics.port_values import PortValues
    from firmware_runtime.statistics.reader import read_statistics
    from firmware_runtime.statistics.statistics import Statistics

_WHERE: Final = {
    # To write models
    "Atomic": "devs.atomic",
    "AtomicClass": "ecdpp.atomic_class",
    "Component": "devs.component",
    "Coupled": "devs.coupled",
    "InPort": "devs.ports",
    "OutPort": "devs.ports",
    "Delay": "models.delay",
    "Motion": "models.motion",
    "Pid": "models.pid",
    "PidGains": "models.pid",
    "SecondOrderPlant": "models.plant",
    "SmithPredictor": "models.smith_predictor",
    "StateDiagram": "models.state_diagram",
    "Arrow": "models.state_table",
    "State": "models.state_table",
    # Time, integer nanoseconds
    "MICROSECOND": "devs.time",
    "MILLISECOND": "devs.time",
    "NANOSECOND": "devs.time",
    "NEVER": "devs.time",
    "SECOND": "devs.time",
    "format_time": "devs.time",
    "seconds": "devs.time",
    # To run them
    "ClassicSimulator": "devs.classic",
    "Listening": "devs.ports",
    "Simulator": "devs.simulator",
    "trace": "devs.trace",
    "tree": "devs.tree",
    "Clock": "executive.clocks",
    "MonotonicClock": "executive.clocks",
    "ScaledClock": "executive.clocks",
    "VirtualClock": "executive.clocks",
    "Configuration": "executive.configuration",
    "PathDeadline": "executive.deadlines",
    "Inbox": "executive.inbox",
    "Source": "executive.inbox",
    "Executive": "executive.executive",
    "Outcome": "executive.outcome",
    "ActivationPolicy": "executive.policy",
    "ProcessSettings": "executive.process",
    "open_model": "runs.model_alone",
    "run": "runs.model_alone",
    "OpenBoard": "runs.open_board",
    "open_board": "runs.open_board",
    "OpenRun": "runs.open_run",
    "open_recording": "recording.exports.recorded_run",
    "RecordedRun": "recording.exports.recorded_run",
    "PortValues": "statistics.port_values",
    "RunResult": "runs.open_run",
    "Figures": "statistics.figures",
    "ModelFigures": "statistics.figures",
    "read_statistics": "statistics.reader",
    "RunState": "statistics.file_header",
    "Statistics": "statistics.statistics",
    # To speak to chips, and to make a robot of them
    "BoardDefinition": "board.definition",
    "BoardSettings": "board.settings",
    "Ending": "board.robot",
    "Device": "board.faults",
    "Lines": "board.robot",
    "Robot": "board.robot",
    "BusLoad": "hal.budget",
    "PeriodicTransaction": "hal.budget",
    "EnableLine": "hal.interlock",
    "Fault": "hal.wire_errors",
    "I2cBus": "hal.i2c",
    "Message": "hal.i2c",
    "Interlock": "hal.interlock",
    "always_enabled": "hal.interlock",
    "SerialPort": "hal.serial",
    "Strike": "hal.strike",
    # Errors, by who must act
    "CouplingError": "devs.model_errors",
    "IllegitimateModel": "devs.model_errors",
    "ModelError": "devs.model_errors",
    "ModelFailure": "devs.model_errors",
    "ModelTimeError": "devs.model_errors",
    "OutputChangedState": "devs.model_errors",
    "PortTypeError": "devs.model_errors",
    "SelectError": "devs.model_errors",
    "SentOutsideOutput": "devs.model_errors",
    "TimeAdvanceError": "devs.model_errors",
    "ConfigError": "errors",
    "FirmwareRuntimeError": "errors",
    "SettingError": "errors",
    "UnknownName": "errors",
    "AddressInUse": "hal.wire_errors",
    "ArbitrationLost": "hal.wire_errors",
    "BusAbsent": "hal.wire_errors",
    "BusFault": "hal.wire_errors",
    "BusInUse": "hal.wire_errors",
    "BusTimeout": "hal.wire_errors",
    "HalError": "hal.wire_errors",
    "Implausible": "hal.wire_errors",
    "NoAcknowledge": "hal.wire_errors",
    "NotReady": "hal.wire_errors",
    "PortClosed": "hal.wire_errors",
    "Runaway": "hal.wire_errors",
    "Stuck": "hal.wire_errors",
    "WrongDevice": "hal.wire_errors",
    "StateTableError": "models.state_table",
    "StatisticsFileError": "errors",
}
"""The room and module of each public name, below this package."""

__all__ = [
    "MICROSECOND",
    "MILLISECOND",
    "NANOSECOND",
    "NEVER",
    "SECOND",
    "ActivationPolicy",
    "AddressInUse",
    "ArbitrationLost",
    "Arrow",
    "Atomic",
    "AtomicClass",
    "BoardDefinition",
    "BoardSettings",
    "BusAbsent",
    "BusFault",
    "BusInUse",
    "BusLoad",
    "BusTimeout",
    "ClassicSimulator",
    "Clock",
    "Component",
    "ConfigError",
    "Configuration",
    "Coupled",
    "CouplingError",
    "Delay",
    "Device",
    "EnableLine",
    "Ending",
    "Executive",
    "Fault",
    "Figures",
    "FirmwareRuntimeError",
    "HalError",
    "I2cBus",
    "IllegitimateModel",
    "Implausible",
    "InPort",
    "Inbox",
    "Interlock",
    "Lines",
    "Listening",
    "Message",
    "ModelError",
    "ModelFailure",
    "ModelFigures",
    "ModelTimeError",
    "MonotonicClock",
    "Motion",
    "NoAcknowledge",
    "NotReady",
    "OpenBoard",
    "OpenRun",
    "OutPort",
    "Outcome",
    "OutputChangedState",
    "PathDeadline",
    "PeriodicTransaction",
    "Pid",
    "PidGains",
    "PortClosed",
    "PortTypeError",
    "PortValues",
    "ProcessSettings",
    "RecordedRun",
    "Robot",
    "RunResult",
    "RunState",
    "Runaway",
    "ScaledClock",
    "SecondOrderPlant",
    "SelectError",
    "SentOutsideOutput",
    "SerialPort",
    "SettingError",
    "Simulator",
    "SmithPredictor",
    "Source",
    "State",
    "StateDiagram",
    "StateTableError",
    "Statistics",
    "StatisticsFileError",
    "Strike",
    "Stuck",
    "TimeAdvanceError",
    "UnknownName",
    "VirtualClock",
    "WrongDevice",
    "always_enabled",
    "format_time",
    "open_board",
    "open_model",
    "open_recording",
    "read_statistics",
    "run",
    "seconds",
    "trace",
    "tree",
]


if not TYPE_CHECKING:  # with it, type checkers would take any name for a public one

    def __getattr__(name: str) -> object:
        """Load a public name from the module that defines it."""
        if name not in _WHERE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found: object = getattr(import_module(f"{__name__}.{_WHERE[name]}"), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
