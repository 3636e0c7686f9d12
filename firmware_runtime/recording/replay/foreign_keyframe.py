"""What is said where a replay cannot begin with a keyframe."""

from collections.abc import Sequence

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.blackbox.state.keyframes import ForeignState


def foreign_keyframe(error: ForeignState, code_changed: Sequence[str]) -> ConfigError:
    """Mostly the code is another, in these modules; else it is said what cannot be set back."""
    fault = "its models are not those of the recording's keyframes"
    if not (error.is_of_another_robot or code_changed):
        fault = f"a keyframe of the recording cannot be set back ({text_of(error)})"
    expected = "expected the code of the run, or to begin where the recording does, at its start"
    return ConfigError.of_one("replay", f"{fault}; {expected}")
