"""The cell in the simulator: `kr5 record` and `kr5 scene`."""
