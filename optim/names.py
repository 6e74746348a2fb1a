"""The methods for all problems by name, with a few words for each: known without any solver."""

IN_WORDS: dict[str, str] = {
    "gradient": "nonlinear programming by scipy on exact derivatives",
    "cma": "evolution by the package cma, where it is installed",
}
