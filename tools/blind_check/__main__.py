"""`python -m blind_check`: see `--help`."""

from .cli import main

if __name__ == "__main__":
    main()
