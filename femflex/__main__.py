"""`python -m femflex` is the command line."""

from femflex.cli import main

if __name__ == "__main__":
    main()
