"""`python -m stribeck`: the command line."""

from stribeck.cli import main

if __name__ == "__main__":
    main()
