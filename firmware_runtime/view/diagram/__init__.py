"""Pictures of a model, drawn from its own declaration: couplings and state tables, SVG or Mermaid.

The layout of couplings goes in steps, a module each: `boxes` (how large), `columns` (left to
right), `rows` (top to bottom), `routes` (the wires between).
"""
