"""Whether HEAD takes more processor time than BASE, decided on pairs; or "cannot tell here"."""
