"""Pages and Rerun recordings in which a cell moves."""
