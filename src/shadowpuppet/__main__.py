"""`python -m shadowpuppet`."""

from shadowpuppet.entry import main

if __name__ == "__main__":
    main()
