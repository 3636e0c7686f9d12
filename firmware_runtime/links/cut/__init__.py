"""The two ends of a model that is cut at its couplings, and what carries values between them."""
