"""The hold model, atomics that only wait, on both kernels; a part of the bench `devstone`."""
