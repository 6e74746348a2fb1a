"""How axes are written: known without JAX."""

RANDOM = ("sobol", "latin")
"""How the values of random axes are drawn, all axes of a kind together."""
FORMS = (
    "LOW:HIGH:N (even), LOW:HIGH:N:log, values as 0.1,0.2,0.5, or LOW:HIGH:sobol and "
    "LOW:HIGH:latin, either with :log, for random ones"
)
IN_WORDS = {
    "LOW:HIGH:N": "N values, even from LOW to HIGH",
    "LOW:HIGH:N:log": "the same, even in the logarithm",
    "A,B,C": "these values",
    "LOW:HIGH:sobol": "random: a coordinate of a Sobol sequence of --samples points",
    "LOW:HIGH:latin": "random: a coordinate of a Latin hypercube; either also with :log",
}
"""The forms of an axis, for the help."""
