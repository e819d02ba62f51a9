"""Logs of a real cell turned into recordings: `kr5 recording`."""
