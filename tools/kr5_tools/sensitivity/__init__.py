"""`kr5 sensitivity`: which uncertain input of a model makes how much of the variance of its outputs."""
