"""Whether the truth lies in the intervals of `identify` as often as they say."""
