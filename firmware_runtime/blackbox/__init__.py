"""The black box of a run: what entered at the edge, always recorded, and the run replayed."""
