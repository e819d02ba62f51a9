"""Files read and written by more than one command."""
