"""The UGV's instances. Functions here build problems in double precision: call them inside
`jax.enable_x64(True)`, as `Instance.problems` does."""
