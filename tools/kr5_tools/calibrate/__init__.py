"""Estimates of where things are: `kr5 calibrate ...`."""
