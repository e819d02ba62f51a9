"""Insertions over tilts and clearances: `kr5 sweep`."""
