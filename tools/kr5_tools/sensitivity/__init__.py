"""`kr5 sensitivity`: uncertain inputs of a model ranked by their share of the variance of its outputs."""
