"""`python -m kr5_bench`: see `--help`."""

from .cli import main

if __name__ == "__main__":
    main()
