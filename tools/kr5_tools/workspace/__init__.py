"""Reach and dexterity of an arm."""
