"""The UGV's speed, accuracy and bounds, measured: `python -m benchmarks.ugv`."""
