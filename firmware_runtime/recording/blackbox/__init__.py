"""The black box: what entered a run at its edge, kept always, so that the run can be run again.

    lines, loop  ->  recorder  ->  ring (shared memory beside the statistics)  ->  reader

What enters is all that is kept: the bytes of buses and ports and how each transfer ended, external
events, what the clock said within steps, whether outputs were enabled, settings. The drivers and
models are deterministic, so everything else follows from it
(`firmware_runtime.recording.replay`). What left a port is kept beside it, to compare with.
"""
