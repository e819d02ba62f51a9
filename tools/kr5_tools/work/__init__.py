"""The work from bin to tube: its state machine as a diagram, its journal in words."""
