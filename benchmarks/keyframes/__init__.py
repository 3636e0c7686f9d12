"""Whether a fast loop ever waits for a keyframe of its recording."""
