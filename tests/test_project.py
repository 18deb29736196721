"""The rules of the project that a reader would otherwise have to trust."""

import ast
import os
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from types import ModuleType

import pytest

import clockdrive
import mounts
import pointing
import transports
from clockdrive.configuration_keys import DRIVE_KINDS

CHECKOUT = Path(__file__).resolve().parents[1]
PACKAGES = (clockdrive, mounts, pointing, transports)
BELOW_THE_APPLICATION = (mounts, pointing, transports)
CLOCKS = {  # what takes the time instead of being given it
    "time": {"time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "sleep"},
    "datetime": {"now", "utcnow", "today"},
    "date": {"today"},
    "Time": {"now"},
}
OF_POSIX = ("fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty")
AS_ON_WINDOWS = """
import builtins, importlib, os, sys, types
packages, blocked, real = sys.argv[1].split(","), set(sys.argv[2].split(",")), builtins.__import__
for module in sys.argv[3:]:
    importlib.import_module(module)  # with all that others need, whatever their system

def asked(name, globals=None, *args):
    importer = (globals or {}).get("__name__", "").split(".")[0]
    if importer in packages and name.split(".")[0] in blocked:
        raise ModuleNotFoundError(f"{importer} asks for {name}")
    return real(name, globals, *args)

for name in [name for name in sys.modules if name.split(".")[0] in packages]:
    del sys.modules[name]
for name in ("fork", "killpg", "openpty", "getsid", "getuid"):
    delattr(os, name)
builtins.__import__, sys.platform = asked, "win32"
sys.modules["msvcrt"] = types.SimpleNamespace(locking=None, LK_NBLCK=2)
for module in sys.argv[3:]:
    importlib.import_module(module)
print(len(sys.argv[3:]))
"""
UNFINISHED = re.compile(r"\b(TO[D]O|FIX[M]E|X[X]X|NotImplemented[E]rror|x[f]ail)\b")
MACHINE = re.compile(
    r"(?<![\w.])/(wor[k]|tm[p]|roo[t]|hom[e])/|https?://(localhost|[\w.-]*(pyp[i]|npmj[s]|proxy\.golan[g]))"
)


def sources(package: ModuleType) -> list[Path]:
    return sorted(Path(str(files(package))).rglob("*.py"))


def modules() -> list[str]:
    """Every module of the four packages; a package's main program is not imported but run."""
    return [
        ".".join((package.__name__, *path.relative_to(Path(str(files(package)))).with_suffix("").parts)).removesuffix(
            ".__init__"
        )
        for package in PACKAGES
        for path in sources(package)
        if path.stem not in {"__main__", "dead_man"}
    ]


def test_every_module_is_imported_as_on_windows_without_anything_of_posix() -> None:
    command = [sys.executable, "-c", AS_ON_WINDOWS, ",".join(p.__name__ for p in PACKAGES), ",".join(OF_POSIX)]
    done = subprocess.run([*command, *modules()], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-1000:]
    assert int(done.stdout) > 100


def clocks_read(source: Path) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        match node:
            case ast.Attribute(value=ast.Name(id=owner) | ast.Attribute(attr=owner), attr=attribute):
                taken = attribute in CLOCKS.get(owner, ())
            case ast.ImportFrom(module="time", names=names):
                taken = any(alias.name in CLOCKS["time"] for alias in names)
            case _:
                continue
        if taken:
            found.append(f"{source.name}:{node.lineno}: {ast.unparse(node)}")
    return found


def tracked_texts() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=CHECKOUT, capture_output=True, text=True, check=True)
    kinds = {".py", ".md", ".toml", ".yaml", ".ipynb", ""}
    paths = (CHECKOUT / line for line in listed.stdout.splitlines())
    return [path for path in paths if path.suffix in kinds and path.is_file()]


def lines_matching(pattern: re.Pattern[str], paths: list[Path]) -> list[str]:
    return [
        f"{path.relative_to(CHECKOUT)}:{number}: {line.strip()}"
        for path in paths
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if pattern.search(line)
    ]


def test_the_code_under_test_is_the_one_meant():
    home = {Path(package.__file__).resolve().parents[1] for package in PACKAGES}
    assert len(home) == 1
    if os.environ.get("CLOCKDRIVE_INSTALLED") == "1":
        assert home.pop().name == "site-packages"
    else:
        assert home == {CHECKOUT}, "install the checkout itself: pip install -e '.[dev]'"


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_every_package_ships_its_types(package):
    assert files(package).joinpath("py.typed").is_file()


@pytest.mark.parametrize("package", BELOW_THE_APPLICATION, ids=lambda package: package.__name__)
def test_time_is_given_and_never_taken_below_the_application(package):
    assert [place for source in sources(package) for place in clocks_read(source)] == []


def test_a_clock_that_is_read_would_be_found(tmp_path):
    source = tmp_path / "reader.py"
    lines = (
        "import time, datetime",
        "time.sleep(1)",
        "datetime.datetime.now()",
        "from time import monotonic",
        "clock.now()",
    )
    source.write_text("\n".join(lines))
    assert [place.split(":")[1] for place in clocks_read(source)] == ["4", "2", "3"]


def test_importing_the_application_is_light():
    heavy = ("astropy", "numpy", "erfa", "pymodbus", "pyongc", "rich", "serial")
    code = f"import sys, clockdrive; print([name for name in {heavy!r} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout == "[]\n"


@pytest.mark.checkout
def test_imports_go_one_way():
    run = subprocess.run(
        [
            sys.executable,
            "-c",
            "from importlinter.cli import lint_imports_command; lint_imports_command()",
            "--no-cache",
        ],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_the_application_knows_no_kind_of_drives_by_its_name():
    home = Path(str(files(clockdrive)))
    knowing = {
        home / "configuration_keys.py",
        *(home / "drives").rglob("*.py"),
    }  # one table, and the kinds themselves
    told = [
        f"{source.name}:{node.lineno}: {node.value}"
        for source in sources(clockdrive)
        if source not in knowing
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in DRIVE_KINDS
    ]
    assert told == []


@pytest.mark.checkout
def test_nothing_is_left_unfinished():
    assert lines_matching(UNFINISHED, [path for path in tracked_texts() if path.suffix == ".py"]) == []


@pytest.mark.checkout
def test_nothing_names_a_place_of_one_machine():
    assert lines_matching(MACHINE, tracked_texts()) == []


@pytest.mark.checkout
def test_every_link_of_the_documentation_leads_somewhere():
    pages = [path for path in tracked_texts() if path.suffix == ".md"]
    links = [
        (page, target)
        for page in pages
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
        if "://" not in target
    ]
    assert links
    broken = [
        f"{page.relative_to(CHECKOUT)}: {target}" for page, target in links if not (page.parent / target).exists()
    ]
    assert broken == []


@pytest.mark.checkout
@pytest.mark.parametrize(
    ("name", "ends"),
    [("goto", ".venv/bin/clockdrive goto best --for 20s"), ("tests", ".venv/bin/pytest -n 2")],
)
def test_the_readme_prints_the_commands_that_the_check_runs(name, ends):
    readme = (CHECKOUT / "README.md").read_text(encoding="utf-8")
    printed = re.search(rf"<!-- command: {name} -->\n```sh\n(.+)\n```", readme)
    assert printed is not None
    assert printed[1].startswith("python3 -m venv .venv && .venv/bin/pip install ")
    assert printed[1].endswith(ends)
