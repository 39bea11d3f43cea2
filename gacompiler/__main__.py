"""``python -m gacompiler`` is ``gac``."""

from .cli import main

if __name__ == "__main__":
    main()
