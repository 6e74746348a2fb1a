"""The legend explains every letter and mark of the drawing."""

import itertools

from stickslip.envs.rendering.biped.header import draw_key


class Words:
    """A canvas that keeps what is written on it, with its height."""

    def __init__(self):
        self.words: dict[str, float] = {}

    def text(self, x: float, y: float, words: str, *style, **place):
        self.words[words] = y

    def lines(self, *what, **place):
        pass


def test_letters_marks_and_dashes_are_explained_one_below_the_other():
    canvas = Words()
    draw_key(canvas, 0.0, 300.0)
    said = " ".join(canvas.words)
    for part in ("A crank", "B rocker", "D tendons", "zero-moment point", "how far", "kinetic"):
        assert part in said
    heights = list(canvas.words.values())
    assert all(above - below >= 13 for above, below in itertools.pairwise(heights))
