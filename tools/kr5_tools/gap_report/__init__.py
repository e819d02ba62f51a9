"""The page of a diagnosis, and its sentences."""
