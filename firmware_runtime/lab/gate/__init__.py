"""Decision on pairs: does HEAD take more processor time than BASE, or "cannot tell here"."""
