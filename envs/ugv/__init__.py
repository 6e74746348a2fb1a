"""The UGV's environment: what is stepped, observed, rewarded, drawn at random and shown."""
