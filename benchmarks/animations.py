"""What writes an animation best: this project's containers and palette, or Pillow's.

    python -m benchmarks.animations [--only PART ...] [--docs docs/design.md]

A walk over a wet floor, 25 pictures a second, whose last picture stands for a second more. Each
file is written in a process of its own from pictures on the disk, then read back and compared with
them; palettes, and the search for the nearest entry, are compared on some of the pictures. "Pillow"
gives its writer the pictures as they were drawn, "Pillow, our palette" palette entries that were
found here. Memory is the most that was held at once, above what the process held before; seconds
are processor time.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import kept_parts, markdown, options, put_between, write_json
from stickslip.envs.rendering import save_animation
from stickslip.envs.rendering.film.palette import COLOURS, Indexer, PaletteCount

FPS, STILL, SOME = 25, 25, 25
"""Pictures a second; how often the last one is repeated; how many palettes are compared on."""
PARTS = ("files", "palettes")
MARKS = ("<!-- animations -->", "<!-- end of animations -->")


@dataclass(frozen=True)
class Film:
    """Pictures on the disk, read one at a time and as often as asked for."""

    folder: Path
    drawn: int
    """How many there are; the last one stands on."""

    def __len__(self) -> int:
        return self.drawn + STILL

    def __iter__(self) -> Iterator[np.ndarray]:
        for index in range(len(self)):
            yield np.load(self.folder / f"{min(index, self.drawn - 1)}.npy")


def draw(folder: Path, seconds: float) -> None:
    """Draw a walk of that length, a file a picture."""
    from stickslip.agents.biped.controllers import controller_by_name
    from stickslip.agents.biped.scenes import SCENES
    from stickslip.agents.evaluation.rollout import rollout
    from stickslip.agents.pictures.film import pictures
    from stickslip.envs import BipedEnv

    env = BipedEnv()
    params = env.make_params(scene=SCENES["wet"], time_limit=seconds)
    played = rollout(env, controller_by_name("computed-torque"), params, 0)
    for index, picture in enumerate(pictures(env, played, params, FPS)):
        np.save(folder / f"{index}.npy", picture)


def ours(film: Film, path: Path) -> None:
    """As every command writes it."""
    save_animation(film, path, FPS)


@dataclass(frozen=True)
class Sequence:
    """What Pillow takes for several pictures: it goes through them twice."""

    film: Film
    turned: Callable[[np.ndarray], Any]

    def __iter__(self) -> Iterator[Any]:
        pictures = iter(self.film)
        next(pictures)
        return map(self.turned, pictures)


def pillow(film: Film, path: Path) -> None:
    """Pillow's writer, its palettes, its differences."""
    from PIL import Image

    _save(film, path, Image.fromarray)


def pillow_with_our_palette(film: Film, path: Path) -> None:
    """Pillow's writer and differences for palette entries."""
    from PIL import Image

    count = PaletteCount()
    for picture in film:
        count.add(picture)
    palette = count.palette()
    indexer = Indexer(palette)

    def indexed(picture: np.ndarray) -> Any:
        image = Image.fromarray(indexer(picture))
        image.putpalette(palette.tobytes())
        return image

    _save(film, path, indexed, optimize=False)


def _save(film: Film, path: Path, turned: Callable[[np.ndarray], Any], **how: Any) -> None:
    first = turned(next(iter(film)))
    duration = 1000 // FPS
    rest = Sequence(film, turned)
    first.save(path, save_all=True, append_images=rest, duration=duration, loop=0, **how)


WAYS = {"ours": ours, "Pillow, our palette": pillow_with_our_palette, "Pillow": pillow}
CASES = [(way, suffix) for suffix in (".gif", ".png") for way in WAYS] + [("ours", ".webp")]


def measure(way: str, suffix: str, film: Film) -> dict[str, Any]:
    """Write one file in this process and compare it with the pictures."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"walk{suffix}"
        WAYS[way](Film(film.folder, 2), path)  # loads what it needs
        Path("/proc/self/clear_refs").write_text("5")
        before, used = _memory("VmRSS"), time.process_time()
        WAYS[way](film, path)
        seconds, held = time.process_time() - used, _memory("VmHWM") - before
        size = path.stat().st_size
        return {
            "format": suffix,
            "written by": way,
            "pictures given": len(film),
            **read_back(path, film),
            "MB": f"{size / 1e6:.2f}",
            "memory [MB]": f"{held / 1e3:.0f}",
            "seconds": f"{seconds:.1f}",
        }


def read_back(path: Path, film: Film) -> dict[str, Any]:
    """How many pictures a file has, how long they stand, and how far their colours are off."""
    from PIL import Image, ImageSequence

    ends, errors, worst, pictures = [], [], 0, iter(film)
    shown, off = 0, 0.0
    with Image.open(path) as animation:
        for image in ImageSequence.Iterator(animation):
            back = np.asarray(image.convert("RGB")).astype(int)
            off += float(image.info["duration"])
            ends.append(off)
            while shown < min(round(off * FPS / 1000), len(film)):
                error = np.abs(back - next(pictures)).max(axis=2)
                errors.append(float((error > 0).mean()))
                worst, shown = max(worst, int(error.max())), shown + 1
        count = len(ends)
    return {
        "in the file": count,
        "of wrong colour": f"{np.mean(errors):.2%}",
        "worst, of 255": worst,
    }


def search(film: Film) -> list[dict[str, Any]]:
    """How well palettes and the search for the nearest entry keep the colours of some pictures."""
    from PIL import Image

    pictures = list(itertools.islice(film, 0, film.drawn, max(1, film.drawn // SOME)))
    count = PaletteCount()
    for picture in pictures:
        count.add(picture)
    palette = count.palette()
    every_third = Image.fromarray(np.concatenate([picture[::3] for picture in pictures]))
    theirs = np.array(every_third.quantize(COLOURS).getpalette(), np.uint8).reshape(-1, 3)
    given = Image.new("P", (1, 1))
    given.putpalette(palette.tobytes())

    def found_by_pillow(picture: np.ndarray) -> np.ndarray:
        image = Image.fromarray(picture)
        return np.asarray(image.quantize(palette=given, dither=Image.Dither.NONE).convert("RGB"))

    find, find_theirs = Indexer(palette), Indexer(theirs)
    return [
        _errors("ours", "ours", pictures, lambda picture: palette[find(picture)]),
        _errors("Pillow's", "ours", pictures, lambda picture: theirs[find_theirs(picture)]),
        _errors("ours", "Pillow's", pictures, found_by_pillow),
    ]


def _errors(
    palette: str,
    search: str,
    pictures: list[np.ndarray],
    shown: Callable[[np.ndarray], np.ndarray],
) -> dict[str, Any]:
    off = [np.abs(shown(picture).astype(int) - picture) for picture in pictures]
    wrong = np.mean([(one.max(axis=2) > 0).mean() for one in off])
    return {
        "palette": palette,
        "nearest entry found by": search,
        "of wrong colour": f"{wrong:.1%}",
        "mean error, of 255": f"{np.mean([one.mean() for one in off]):.3f}",
    }


def _memory(name: str) -> int:
    """A line of this process's status [kB]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name))


def _read() -> argparse.Namespace:
    parser = options("animations", __doc__)
    parser.add_argument("--seconds", type=float, nargs="+", default=[6.0, 24.0])
    parser.add_argument("--docs", type=Path, help="a page to put the table into")
    parser.add_argument("--only", choices=PARTS, nargs="+", default=PARTS)
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    return parser.parse_args()


def written(film: Film, seconds: list[float]) -> list[dict[str, Any]]:
    """Every way of writing films of every length, each in a process of its own."""
    rows = []
    for way, suffix in CASES:
        for long in seconds:
            drawn = min(film.drawn, 1 + round(long * FPS))
            command = [sys.executable, "-m", "benchmarks.animations", "--one"]
            command += [way, suffix, str(film.folder), str(drawn)]
            found = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True)
            rows.append(json.loads(found.stdout))
            print(rows[-1], file=sys.stderr, flush=True)
    return rows


def main() -> None:
    """Draw a walk, measure what is asked for, put all that is known into the page."""
    given = _read()
    if given.one:
        way, suffix, folder, drawn = given.one
        print(json.dumps(measure(way, suffix, Film(Path(folder), int(drawn)))))
        return
    found = kept_parts(given.out, PARTS)
    found["versions"]["pillow"] = version("pillow")
    with tempfile.TemporaryDirectory() as folder:
        draw(Path(folder), max(given.seconds))
        film = Film(Path(folder), len(list(Path(folder).iterdir())))
        for name in given.only:
            found[name] = written(film, given.seconds) if name == "files" else search(film)
            found["parts"][name] = {key: found[key] for key in ("commit", "measured")}
    write_json(found, given.out)
    tables = "\n\n".join(markdown(found[name]) for name in PARTS if name in found)
    print(tables)
    if given.docs:
        put_between(given.docs, f"\n{tables}\n", MARKS)


if __name__ == "__main__":
    main()
