"""`python -m kr5_tools` is the command `kr5`."""

from kr5_tools.start import main

main()
