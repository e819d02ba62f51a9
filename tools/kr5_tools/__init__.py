"""The `kr5` command: a package a concept; `app.py` names the module of each command."""
