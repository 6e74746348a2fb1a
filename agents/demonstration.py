"""Demonstration of a machine by `stickslip demo`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Generic

from stickslip.agents.training.configuration import Config

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.training.configuration import Trained

TABLE = "table.txt"
"""The file of a finished demo that is written last: it says that the rest is there."""


class Demonstration(ABC, Generic[Config]):
    """One machine's demo: what is trained, and how the policy is compared and shown."""

    directory: ClassVar[str] = "demo"
    """Name of the run's directory; -2, -3, ... follow it where another run has it."""
    files: ClassVar[Mapping[str, str]]
    """Products in the run's directory with their descriptions, without TABLE."""

    @abstractmethod
    def config(self) -> Config:
        """Training configuration."""

    @abstractmethod
    def task_in_words(self, config: Config) -> str:
        """Text of the task, in a line or two."""

    @abstractmethod
    def show(self, trained: Trained[Config], say: Callable[[str], None]) -> str:
        """Compare the policy with the baselines, say so, write `files` and return what was said.

        The text is `text_of` the lines. say: also called with what goes on.
        """

    def write_tables(self, trained: Trained[Config], table: Evaluation) -> None:
        """Write table.csv and table.json into the run's directory."""
        about = {"timesteps": trained.timesteps, "of": trained.config.timesteps}
        about |= {"finished": trained.finished}
        table.write_csv(trained.directory / "table.csv")
        table.write_json(
            trained.directory / "table.json", {"config": trained.config.digest, "training": about}
        )

    def text_of(self, trained: Trained[Config], lines: Iterable[str]) -> str:
        """The lines, and that the training is not finished where it is not."""
        text = "\n".join(lines) + "\n"
        if trained.finished:
            return text
        done, of = trained.timesteps, trained.config.timesteps
        return (
            f"{text}\nThe training is NOT finished: {done:,} of {of:,} steps "
            f"({trained.percent} %).\n"
        )
