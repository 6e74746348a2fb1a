"""A site of one page, with a function of the package described by its docstring."""

import subprocess
import sys
from pathlib import Path

Path("mkdocs.yml").write_text(
    "site_name: one page\ntheme: {name: material, font: false}\nplugins: [mkdocstrings]\n"
)
Path("docs").mkdir()
Path("docs/index.md").write_text("# One page\n\n::: stickslip.agents.load_policy\n")
subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict"], check=True)
if "load_policy" not in Path("site/index.html").read_text():
    sys.exit("the page does not describe load_policy")
