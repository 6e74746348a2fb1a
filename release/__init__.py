"""What is done before a release: build, look into what was built, install it everywhere, use it."""
