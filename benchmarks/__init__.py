"""How long the compiler takes, and how fast its kernels are beside named peers: ``python -m benchmarks``."""
