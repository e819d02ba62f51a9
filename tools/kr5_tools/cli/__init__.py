"""What every command shares: the command line, its terminal, its tables."""
