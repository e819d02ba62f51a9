"""Tables of numbers for every command: which columns hold what it needs, and in which units."""
