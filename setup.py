"""What pyproject.toml has no words for: an editable install puts src/ on the path.

setuptools' finder of mapped folders is asked last, after the path has given the namespace package
that Python makes of any folder named stickslip, such as the checkout itself. A package on the path
comes before those, wherever it stands; the finder then finds the package's parts.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildPy(build_py):
    """setuptools' own, which writes a .pth file into an editable wheel, too."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            wheel = Path(self.get_finalized_command("install").install_lib)
            (wheel / "stickslip-source.pth").write_text(f"{Path('src').resolve()}\n")


setup(cmdclass={"build_py": BuildPy})
