"""One insertion of a peg: `kr5 insert`."""
