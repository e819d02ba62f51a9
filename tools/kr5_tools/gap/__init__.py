"""How far a simulation is from a recording, and why: `kr5 gap`."""
