"""Bin picking of cylinders: clouds, poses, picks, pictures of them."""
