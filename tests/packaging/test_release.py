"""What is checked before a release is complete, and what a release says of itself agrees."""

import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from release import artefacts, installs, tag
from release.__main__ import PYTHONS, checks, main, parser
from release.report import INTERRUPTED, Check, FailedError, Report, Say
from release.tools import quickly, run
from stickslip.cli import EXTRAS
from tests.packaging.test_layers import IMPORT_NAMES

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = PROJECT["optional-dependencies"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def brought(extra: str) -> set[str]:
    """Names of the packages that an extra asks for itself."""
    return {Requirement(line).name for line in OPTIONAL[extra]}


def test_every_program_of_a_newcomer_is_of_an_extra():
    programs = {path.stem for path in installs.NEWCOMER.glob("*.py")} - {"core"}
    assert programs
    assert programs <= {*installs.light(), *installs.PYTORCH}
    assert programs >= set(installs.PYTORCH)
    assert installs.program("train").name == "train.py"
    assert installs.program("an extra without one").name == "core.py"


def test_pytorch_comes_with_its_own_extras_alone():
    needs = {"stable-baselines3", "sbx-rl", "torchrl", "torch"}
    assert {name for name in OPTIONAL if needs & brought(name)} == set(installs.PYTORCH)
    asked = [Requirement(line) for line in OPTIONAL["all"]]
    large = [one for one in asked if one.extras & set(installs.PYTORCH)]
    assert [str(one.marker) for one in large] == ['sys_platform != "linux"']


@pytest.mark.parametrize("package", EXTRAS)
def test_a_missing_package_is_in_the_extra_that_is_named(package: str):
    names = {IMPORT_NAMES.get(name, name) for name in brought(EXTRAS[package])}
    assert package in names | ({"torch"} if "stable_baselines3" in names else set())


def test_the_version_is_one():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"(?m)^version: (.*)$", citation) == [PROJECT["version"]]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"(?m)^## \[?([^\]\n ]+)", changes)
    assert versions[:2] == ["Unreleased", PROJECT["version"]]


TOLD = "# Changelog\n\n## [Unreleased]\n\n## [1.2.0] - 2026-03-01\n\n### Added\n\n- One thing.\n"


@pytest.mark.parametrize(
    ("changed", "into", "fault"),
    [
        ("- One", "- One", ""),
        ("## [1.2.0]", "### Fixed\n\n- Another.\n\n## [1.2.0]", "2 lines under Unreleased"),
        ("[1.2.0]", "[1.1.0]", r"'\[1\.1\.0\] - 2026-03-01' where \[1\.2\.0\] is due"),
        ("2026-03-01", "unreleased", "lacks its date"),
        ("2026-03-01", "2026-02-30", "lacks its date"),
        (" - 2026-03-01", "", "is due, with its date"),
        ("- One thing.", "", "or what changed"),
        ("## [Unreleased]\n\n", "", "does not begin with"),
        ("## ", "", "does not begin with"),
    ],
)
def test_what_a_changelog_leaves_out_of_a_version_is_named(changed: str, into: str, fault: str):
    found = tag.untold(TOLD.replace(changed, into), "1.2.0")
    assert len(found) == bool(fault), found
    assert re.search(fault, "".join(found))


def test_a_tag_of_another_version_is_refused_by_the_workflow_that_publishes(
    capsys: pytest.CaptureFixture[str],
):
    assert tag.main(["v0.0.1"]) == 1
    assert f"the tag is v0.0.1; pyproject.toml has v{PROJECT['version']}" in capsys.readouterr().out
    jobs = (ROOT / ".github/workflows/publish.yml").read_text(encoding="utf-8")
    assert 'run: python -m release.tag "$GITHUB_REF_NAME"' in jobs


def test_tested_pythons_are_those_of_the_classifiers_and_of_the_checks():
    said = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    assert said == list(PYTHONS)
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"
    for python in PYTHONS:
        assert f'"{python}"' in (ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8")


def test_workflows_make_what_the_makefile_has():
    text = "\n".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    asked = set(re.findall(r"run: make ([\w-]+)", text))
    made = set(re.findall(r"(?m)^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8")))
    pages = {"docs"} if not (ROOT / "mkdocs.yml").exists() else set()
    assert "test" in asked
    assert asked - pages <= made


def test_workflows_hold_no_address_and_no_secret():
    for path in WORKFLOWS:
        text = path.read_text(encoding="utf-8")
        assert re.findall(r"https?://|secrets\.|password", text) == [], path.name


def test_workflows_pin_actions_by_commit_and_say_the_version():
    text = "\n".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    used = re.findall(r"uses: (?!\./)(.*)", text)
    assert used
    assert [
        one for one in used if not re.fullmatch(r"[\w/-]+@[0-9a-f]{40} # v\d+(\.\d+)+", one)
    ] == []


def test_workflows_ask_the_release_checks_for_what_they_know():
    text = "\n".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    asked = re.findall(r"run: python -m release(?!\.)(.*)", text)
    assert asked
    for arguments in asked:
        parser().parse_args(arguments.split())


def test_what_is_too_much_or_missing_in_a_wheel_is_named(tmp_path: Path):
    vendor = "envs/rendering/html/vendor/README"
    files = [
        "optim/solving.py",
        "optim/instances/known.json",
        vendor,
        "tests/test_help.py",
        "README.md",
    ]
    right = set(artefacts.belongs_in_wheel(files))
    assert right == {
        "stickslip/optim/solving.py",
        "stickslip/optim/instances/known.json",
        f"stickslip/{vendor}",
        "licenses/LICENSE",
    }
    about = f"stickslip-{PROJECT['version']}.dist-info"
    with zipfile.ZipFile(tmp_path / "a.whl", "w") as archive:
        for name in ("stickslip/optim/solving.py", "tests/test_help.py", f"{about}/METADATA"):
            archive.writestr(name, "")
        archive.writestr(f"{about}/licenses/LICENSE", "")
    with pytest.raises(FailedError, match=r"(?s)too much: .*test_help.*missing: .*known\.json"):
        artefacts.same(set(artefacts.in_wheel(tmp_path / "a.whl")), right)


def test_a_file_of_a_wheel_that_is_other_than_the_checkouts_is_named(tmp_path: Path):
    wheel = tmp_path / "a.whl"
    for content in ((ROOT / "optim" / "solving.py").read_bytes(), b"pass"):
        with zipfile.ZipFile(wheel, "w") as archive:
            archive.writestr("stickslip/optim/solving.py", content)
        if content != b"pass":
            artefacts.as_in_checkout(wheel)
    with pytest.raises(FailedError, match=r"other than .*\['stickslip/optim/solving\.py'\]"):
        artefacts.as_in_checkout(wheel)


def test_what_is_missing_in_a_source_distribution_is_named(tmp_path: Path):
    (tmp_path / "pyproject.toml").write_text("")
    with tarfile.open(tmp_path / "a.tar.gz", "w:gz") as archive:
        for name in ("pyproject.toml", "PKG-INFO"):
            archive.add(tmp_path / "pyproject.toml", f"stickslip-1/{name}")
    found = artefacts.in_source(tmp_path / "a.tar.gz")
    assert found == {"pyproject.toml"}
    right = artefacts.belongs_in_source(["pyproject.toml", "tests/test_help.py", ".gitignore"])
    with pytest.raises(FailedError, match=r"missing: \['tests/test_help\.py'\]"):
        artefacts.same(found, right)


def well(say: Say) -> None:
    pass


def fall(say: Say) -> None:
    say("one step;")
    raise FailedError("it fell")


def stop(say: Say) -> None:
    raise KeyboardInterrupt


def test_checks_that_follow_a_failed_one_go_on_and_a_table_shows_both(
    capsys: pytest.CaptureFixture[str],
):
    made = [Check("core", "3.11", fall), Check("core", "3.12", well), Check("train", "3.12", well)]
    assert Report().run(made) == 1
    said = capsys.readouterr().out
    assert "[1/3] core, 3.11: one step; FAILED 0 s\n[2/3] core, 3.12: well, 0 s\n" in said
    assert "core, 3.11: FAILED\nit fell" in said
    assert "           3.11  3.12\ncore   FAILED 0 s   0 s\ntrain           -   0 s\n" in said
    assert "2 checks passed, 1 failed\n" in said
    assert Report().run(made[1:]) == 0


def test_an_interrupted_run_says_what_was_done(capsys: pytest.CaptureFixture[str]):
    made = [Check("one", "built", well), Check("two", "built", stop)]
    assert Report().run([*made, *made]) == INTERRUPTED
    said = capsys.readouterr().out
    assert said.endswith("1 checks passed, 0 failed, 3 not done\n")


def test_an_interrupted_build_leaves_nothing_to_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(artefacts, "run", lambda *command: stop(print))
    assert main(["--out", str(tmp_path)]) == INTERRUPTED
    assert capsys.readouterr().out.endswith("interrupted; nothing was built, nothing checked\n")


def test_a_run_in_the_background_ends_when_it_is_told_to(tmp_path: Path):
    uv = tmp_path / "uv"
    uv.write_text("#!/bin/sh\nexec sleep 60\n")
    uv.chmod(0o755)
    command = 'trap "" INT; exec "$0" -u -m release --only build --out "$1"'
    with subprocess.Popen(
        ["sh", "-c", command, sys.executable, str(tmp_path / "dist")],
        cwd=ROOT,
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().startswith("building into")
            process.terminate()
            assert process.wait(30) == INTERRUPTED
        finally:
            process.kill()


def test_what_a_command_says_is_told_as_it_comes_and_kept_for_its_failure():
    program = "import sys; print('a'); print('b', file=sys.stderr, flush=True); sys.exit(%d)"
    told: list[str] = []
    assert run(sys.executable, "-c", program % 0, follow=told.append) == "".join(told)
    assert sorted(told) == ["a\n", "b\n"]
    with pytest.raises(FailedError, match=r"(?s)exit status 3\n.*a\n"):
        run(sys.executable, "-c", program % 3)


def test_settings_that_an_environments_xla_lacks_are_left_out(tmp_path: Path):
    python = tmp_path / "python"
    python.write_text(
        '#!/bin/sh\ncase "$XLA_FLAGS" in *$UNKNOWN*) echo "$SAID" >&2; exit 1;; esac\n'
    )
    python.chmod(0o755)
    every = next(
        line.removeprefix("QUICKLY := ")
        for line in (ROOT / "Makefile").read_text(encoding="utf-8").splitlines()
        if line.startswith("QUICKLY := ")
    )
    first, *others = every.split()
    assert others
    said = f"F1 parse_flags_from_env.cc:2] Unknown flag in XLA_FLAGS: {first}"
    for unknown, known in (("--none", every), (first, " ".join(others))):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("UNKNOWN", unknown)
            patch.setenv("SAID", said)
            assert quickly(python) == known
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UNKNOWN", first)
        patch.setenv("SAID", "no module named jax")
        with pytest.raises(FailedError, match="no module named jax"):
            quickly(python)


def test_parts_hold_every_extra_once():
    given = parser().parse_args(["--out", "nowhere", "--torch-backend", "cpu"])
    made = [(check.what, check.where) for check in checks(given, Path("here"))]
    assert len(made) == len(set(made))
    for name in {"core", *OPTIONAL} - set(installs.SEVERAL):
        columns = {where for what, where in made if what == name}
        assert columns == {*PYTHONS} | (set() if name in installs.PYTORCH else {"lowest"}), name


@pytest.mark.long
def test_what_is_built_is_complete(tmp_path: Path):
    pytest.importorskip("uv", reason="needs uv (extra release)")
    assert main(["--only", "build", "--out", str(tmp_path)]) == 0


@pytest.mark.long
@pytest.mark.parametrize("part", ["install", "lowest"])
def test_the_core_installs_and_works(tmp_path: Path, part: str):
    pytest.importorskip("uv", reason="needs uv (extra release)")
    given = ["--python", "3.11", "--extras", "core", "--out", str(tmp_path)]
    assert main(["--only", part, *given]) == 0
