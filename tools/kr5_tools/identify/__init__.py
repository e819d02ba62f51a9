"""Identification of an arm from its motion."""
