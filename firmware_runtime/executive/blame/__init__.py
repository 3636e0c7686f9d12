"""Why an activation was late: what is measured (`blamer`, `usual`), what follows (`rules`)."""
