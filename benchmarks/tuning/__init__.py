"""How often the gains of `tune` are better than the shipped ones, on runs they have not seen."""
