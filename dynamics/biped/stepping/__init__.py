"""One call of a step: trials, events, the integrators' stages."""
