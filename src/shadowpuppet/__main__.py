"""`python -m shadowpuppet`."""

from shadowpuppet.cli import main

if __name__ == "__main__":
    main()
