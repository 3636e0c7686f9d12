"""All that is drawn: the report, plots, diagrams, charts of the terminal, the screen of `top`."""
