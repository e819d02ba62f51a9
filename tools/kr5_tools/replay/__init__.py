"""A page in which a cell moves as it was recorded: `kr5 replay`."""
