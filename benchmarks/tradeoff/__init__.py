"""The trade of speed for accuracy, measured: `python -m benchmarks.tradeoff`."""
