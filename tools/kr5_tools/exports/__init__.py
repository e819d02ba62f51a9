"""Results of calibrations in the forms that other programs read."""
