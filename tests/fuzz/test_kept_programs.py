"""Programs read from the kept ones give what compiled ones give, to the last bit.

Many programs of every part, in processes of their own: compiled, written by several at once, read
again and again, with writers killed in between. STICKSLIP_LOADS, STICKSLIP_KILLS: how many
processes read, and how many are killed.
"""

import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from stickslip.programs import KEPT, _digest, _is_whole
from tests.fuzz.test_disks import Disk

pytestmark = pytest.mark.long

CHILD = """
import hashlib, json, sys
from contextlib import nullcontext
from pathlib import Path

import jax, numpy as np
import jax.numpy as jnp
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, kinematics
from stickslip.dynamics.biped import reduced_inertia, simulate
from stickslip.dynamics.ugv import Track
from stickslip.dynamics.ugv.ground.spline import INTERPOLATIONS
from stickslip.dynamics.ugv.track import TRACKS
from stickslip.envs import BipedEnv
from stickslip.programs import _clear_away, kept_programs

jax.config.update("jax_enable_x64", True)
heard, digests = [], {}
jax.monitoring.register_event_listener(lambda event, **_: heard.append(event.split("/")[-1]))


def note(name, tree):
    digest = hashlib.sha256()
    for leaf in jax.tree.leaves(tree):
        is_key = jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
        values = np.asarray(jax.random.key_data(leaf) if is_key else leaf)
        digest.update(f"{values.dtype} {values.shape}".encode() + values.tobytes())
    digests[name] = digest.hexdigest()


def run():
    x = jnp.asarray(np.random.default_rng(1).uniform(-3.0, 12.0, 200))
    at = np.cumsum(np.random.default_rng(5).uniform(0.2, 0.7, 20))
    makers = {name: getattr(Track, name) for name in TRACKS}
    for kind in INTERPOLATIONS:
        makers[kind] = lambda kind=kind: Track.from_points(at, 0.05 * np.sin(7 * at), kind)
    profile = jax.jit(lambda track, x: track.profile(x))
    for kind, make in makers.items():
        track = make()
        slopes = jax.jit(jax.vmap(lambda x: (jax.grad(track.height)(x), jax.grad(track.slope)(x))))
        note(f"profile {kind}", profile(track, x))
        note(f"slopes {kind}", slopes(x))
    if "all" not in sys.argv:
        return
    robot, phases = BipedParams.from_bars(), jnp.linspace(0.0, 3.0, 64)
    note("inertia", jax.jit(jax.vmap(lambda phase: reduced_inertia(robot, phase)))(phases))
    note("kinematics", jax.jit(jax.vmap(lambda phase: kinematics(robot, phase)))(phases))
    floor = Scene.uniform(0.06, 0.05)
    note("walk", simulate(robot, floor, BipedState(), 1.0, 0.2, 0.01, integrator=RK4Split()))
    env = BipedEnv()
    keys, params = jax.random.split(jax.random.key(0), 8), env.default_params
    obs, state = jax.jit(jax.vmap(env.reset, (0, None)))(keys, params)
    note("reset", (obs, state))
    step = jax.jit(jax.vmap(env.step, (0, 0, 0, None)))
    note("step", step(keys, state, 0.1 + 0 * obs[:, :1], params))


store = None if sys.argv[1] == "none" else Path(sys.argv[1])
if store:
    store.mkdir(exist_ok=True)
    if "tidy" in sys.argv:
        _clear_away(store)
print("begun", flush=True)
with kept_programs(store) if store else nullcontext():
    run()
print(json.dumps({"digests": digests, "hits": heard.count("cache_hits")}))
"""

STAND_IN = """
import os, shutil, sys, zlib
from pathlib import Path
from stickslip import programs

store = Path(sys.argv[1])
print("begun", flush=True)
while True:
    programs._clear_away(store)
    work = store / f".use-{programs._host()}-{os.getpid()}-{os.urandom(4).hex()}"
    programs._lay_out(store, work)
    for _ in range(4):
        path = work / f"jit_f{os.urandom(1).hex()}-cache"
        if not path.exists():  # JAX never writes over what is there, which may be a link
            path.write_bytes(zlib.compress(os.urandom(20000)))
    programs._publish(store, work)
    shutil.rmtree(work)
"""
"""As a command does, without JAX and over and over."""


def start(store: Path | str, *options: str) -> subprocess.Popen[str]:
    settings = {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0", "JAX_COMPILATION_CACHE_DIR": ""}
    paths = os.pathsep.join(filter(None, sys.path))
    command = [sys.executable, "-W", "error", "-c", CHILD, str(store), *options]
    environment = os.environ | settings | {"PYTHONPATH": paths}
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment)


def result(process: subprocess.Popen[str]) -> dict:
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert err == ""
    return json.loads(out.splitlines()[-1])


def test_kept_programs_give_what_compiled_ones_give(tmp_path):
    compiled = result(start("none", "all"))["digests"]
    writers = [start(tmp_path / "store", "all") for _ in range(2)]
    for writer in writers:
        assert result(writer)["digests"] == compiled
    loads = 0
    for _ in range(int(os.environ.get("STICKSLIP_LOADS", "3"))):
        read = result(start(tmp_path / "store", "all"))
        assert read["digests"] == compiled
        assert read["hits"] > len(compiled)
        loads += read["hits"]
    print(f"{loads} programs read, {len(compiled)} outputs of each process as compiled")


def test_writers_that_are_killed_leave_whole_programs_or_none(tmp_path):
    store, chance = tmp_path / "store", random.Random(3)
    compiled = result(start("none"))["digests"]
    kills = int(os.environ.get("STICKSLIP_KILLS", "5"))
    for _ in range(kills):
        process = start(store, "tidy")
        assert process.stdout is not None
        process.stdout.readline()  # begun
        time.sleep(chance.uniform(0.0, 6.0))
        process.kill()
        process.communicate()
    assert result(start(store, "tidy"))["digests"] == compiled
    left = [path for path in store.iterdir() if KEPT.fullmatch(path.name)]
    assert left
    for path in left:
        assert _is_whole(path.read_bytes())
        assert path.name.startswith(_digest(path.read_bytes()))
    assert result(start(store, "tidy"))["digests"] == compiled
    print(f"{kills} kills, {len(left)} whole programs at the end")


@pytest.mark.parametrize("size", ["16k", "64k"])
def test_a_disk_that_is_full_or_read_only_changes_nothing(tmp_path, size):
    disk = Disk(tmp_path / "disk")
    disk.path.mkdir()
    if not disk.mount(f"size={size}"):
        pytest.skip("no right to mount a tmpfs here")
    try:
        compiled = result(start("none"))["digests"]
        store = disk.path / "store"
        assert result(start(store))["digests"] == compiled
        for path in store.iterdir():
            assert _is_whole(path.read_bytes())
        disk.change("ro")
        assert result(start(store))["digests"] == compiled
    finally:
        subprocess.run(["umount", "-l", str(disk.path)], check=True, capture_output=True)


def test_a_store_that_several_write_to_and_are_killed_in_holds_whole_programs_alone(tmp_path):
    chance, seen = random.Random(5), 0
    paths = os.pathsep.join(filter(None, sys.path))
    command = [sys.executable, "-c", STAND_IN, str(tmp_path)]
    pipe = subprocess.PIPE

    def begin() -> subprocess.Popen[bytes]:
        child = subprocess.Popen(command, stdout=pipe, env=os.environ | {"PYTHONPATH": paths})
        assert child.stdout is not None
        child.stdout.readline()
        return child

    kills = int(os.environ.get("STICKSLIP_KILLS", "20"))
    children = [begin(), begin()]
    for number in range(kills):
        time.sleep(chance.uniform(0.0, 0.2))
        victim = children[number % 2]
        assert victim.poll() is None  # nothing that another one does ends it
        victim.kill()
        victim.communicate()
        for path in tmp_path.iterdir():
            if found := KEPT.fullmatch(path.name):
                try:
                    content = path.read_bytes()
                except FileNotFoundError:
                    continue  # the other one has dropped it
                assert found[1] == _digest(content)
                assert _is_whole(content)
                seen += 1
        children[number % 2] = begin()
    for child in children:
        child.kill()
        child.communicate()
    print(f"{kills} kills, {seen} programs looked at")
