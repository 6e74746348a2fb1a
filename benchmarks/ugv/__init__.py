"""The UGV's speed, accuracy and optimisers, measured: `python -m benchmarks.ugv`."""
