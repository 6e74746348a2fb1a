#!/usr/bin/env bash
# Release check: build from the tracked files, install the wheel, run the tests.
#
#   release/check.sh
#   PYTHONS=3.12 EXTRAS=core release/check.sh
#
# Each Python that is there gets an environment for each set of extras. `core` runs
# tests/packaging/installed_checks.py, and `lowest` does so with the lowest versions that
# pyproject.toml accepts; `all` runs the quick tests out of the source distribution, `all,sb3` those
# that need Stable-Baselines3. dist/ keeps what was built. The first failure ends the check.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
pythons=${PYTHONS:-3.11 3.12 3.13}
extras=${EXTRAS:-core lowest all all,sb3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset PYTHONPATH
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 JAX_PLATFORMS=cpu

echo "build"
mkdir "$work/source"
git ls-files -z | xargs -0 cp --parents -t "$work/source"
python3 -m venv "$work/tools"
"$work/tools/bin/pip" install -q build twine
"$work/tools/bin/python" -m build --outdir "$work/dist" "$work/source" >"$work/log" || {
	cat "$work/log"
	exit 1
}
"$work/tools/bin/twine" check --strict "$work"/dist/*
diff <(tar -tzf "$work"/dist/*.tar.gz | sed -E 's|^[^/]*/||' |
	grep -vE '/$|^$|^PKG-INFO$|^setup.cfg$|\.egg-info/' | sort) \
	<(git ls-files | grep -v '^\.' | sort) || {
	echo "the source distribution does not hold the tracked files" >&2
	exit 1
}
mkdir -p dist
cp "$work"/dist/* dist/
wheel=$(echo "$work"/dist/*.whl)
tar -xzf "$work"/dist/*.tar.gz -C "$work"
source=$(echo "$work"/stickslip-*/)

# "name>=1.2" of the core dependencies as "name==1.2".
sed -n '/^dependencies = \[/,/^\]/s/^ *"\([a-zA-Z0-9_-]*\)>=\([0-9.]*\).*/\1==\2/p' pyproject.toml \
	>"$work/lowest"

check() { # PYTHON EXTRAS
	local home=$work/$1-$2 python constraints=/dev/null wanted=$wheel[$2]
	"python$1" -m venv "$home"
	python=$home/bin/python
	case $2 in
	core) wanted=$wheel ;;
	lowest) wanted=$wheel constraints=$work/lowest ;;
	*) constraints=$root/constraints.txt ;;
	esac
	"$python" -m pip install -q -c "$constraints" "$wanted"
	case $2 in
	core | lowest) (cd "$home" && "$python" -I "$root/tests/packaging/installed_checks.py") ;;
	*sb3*) (cd "$source" && "$python" -m pytest -q -m "sb3 and not long") ;;
	*) (cd "$source" && "$python" -m pytest -q -n 2 --dist loadfile) ;;
	esac
	rm -rf "$home"
}

for python in $pythons; do
	if ! "python$python" -c "" 2>/dev/null; then
		echo "Python $python is not there: skipped"
		continue
	fi
	for names in $extras; do
		if [ "$names" = lowest ] && [ "$python" != "${pythons%% *}" ]; then continue; fi
		echo "Python $python, $names"
		check "$python" "$names"
	done
done
echo "passed"
