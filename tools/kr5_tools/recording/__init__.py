"""Recordings from logs of a real cell: `kr5 recording`."""
