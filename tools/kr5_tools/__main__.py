"""`python -m kr5_tools` is the command `kr5`."""

from .cli import main

main()
