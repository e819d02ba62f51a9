"""The `kr5` command. One file a command: `<name>.py`, or `<group>_<name>.py` for `kr5 <group> <name>`."""
