"""Targets drawn, printed, rendered and found in images: `kr5 target`, `kr5 detect`, `kr5 render`."""
