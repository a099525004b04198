"""``python -m dmpcli`` is the same as the installed command."""

from dmpcli.cli import main

if __name__ == "__main__":
    main()
