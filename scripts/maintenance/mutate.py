"""Mutate the code that safety rests on, and count the mutants that its tests kill.

A mutant is the module with one small change: another operator, number or function, a condition that is dropped, negated
or never met, an assignment without effect. The formulas of the error budget are changed like code. Each mutant is
imported without compilation, and the tests of its module run until one fails; the rest of the package stays compiled.
Those that are listed as equivalent are not run.
The exit code is 1 if a group of modules has fewer kills than wanted.

Run: python scripts/maintenance/mutate.py [MODULE...] [--mutants N] [--seed S] [--jobs N] [--out FILE]
"""

import argparse
import ast
import contextlib
import gc
import importlib
import importlib.machinery
import io
import json
import os
import random
import resource
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numba
import pytest
import yaml
from hypothesis import HealthCheck, Phase, settings
from tqdm import tqdm

from scripts.maintenance.mutants import mutants

ROOT = Path(__file__).resolve().parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.yaml")
SAFETY, BODIES = "tests/safety/test_", "tests/integration/test_clear_bodies.py"
GROUPS: dict[str, dict[str, tuple[str, ...]]] = {
    "certificate": {
        "safety/clear": (f"{SAFETY}clear.py", BODIES, f"{SAFETY}certificates.py"),
        "safety/certificates": (f"{SAFETY}certificates.py",),
        "robot/motion": ("tests/robot/test_motion.py",),
        "control/rollout": ("tests/control/test_rollout.py",),
        "surroundings/separation": ("tests/surroundings/test_separation.py", BODIES),
        "surroundings/unseen": ("tests/surroundings/test_unseen.py", BODIES),
    },
    "safety region": {
        "surroundings/safe_region": ("tests/surroundings/test_safe_region.py", "tests/surroundings/test_views.py"),
        "surroundings/chords": ("tests/surroundings/test_chords.py",),
        "surroundings/looks": ("tests/surroundings/test_looks.py",),
    },
    "shield": {
        "safety/shield": (f"{SAFETY}shield.py", f"{SAFETY}clear.py"),
        "systems/twist_shield": ("tests/systems/test_twist_shield.py",),
    },
    "moving certificate": {"safety/moving_certificate": (f"{SAFETY}moving_certificate.py",)},
    "error budget": {
        "scenario/error_budget": ("tests/scenario/test_error_budget.py", "tests/scenario/test_margins.py"),
        "scenario/margins": ("tests/scenario/test_margins.py",),
    },
}
"""The modules, and the tests that must kill their mutants. Records without code have none."""
WANTED = 0.95
"""Least share of the mutants of a group, but for equivalent ones, that must be killed."""
LONGEST = 3.0
"""Tests that take more processor time without compilation are left out, s."""
WARM_UP = 6.0
"""The same with compilation, before the first mutant."""
SLOWER, LATE = 3.0, 4.0
"""A mutant of which one test, or all, take so many times their usual time, and so many seconds more,
is killed; more than LONGEST, as usual times are halved."""
MEMORY = 4 << 30
"""That a mutant may take beyond what its parent has, bytes."""


class Tests:
    """Runs the tests of known durations, the shortest first; or all, and keeps the durations of those that end in time.

    Attributes:
        durations: processor time of each test, s.
        longest: time that a test may take if none is known, s.
        killer: the test that failed.
    """

    def __init__(self, durations: dict[str, float], longest: float = LONGEST) -> None:
        self.chosen, self.durations, self.longest, self.killer = durations, dict(durations), longest, ""

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection(self) -> None:
        settings.register_profile(
            "mutants",
            phases=[Phase.explicit, Phase.generate],
            report_multiple_bugs=False,
            suppress_health_check=list(HealthCheck),
        )
        settings.load_profile("mutants")

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if self.chosen:
            items[:] = [item for item in items if item.nodeid in self.chosen]
            items.sort(key=lambda item: self.chosen[item.nodeid])

    def pytest_collection_finish(self) -> None:
        numba.config.DISABLE_JIT = False  # what stays compiled may have to be for what now calls it

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.killer = f"{report.nodeid}: does not import"

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        late = SLOWER * self.chosen.get(item.nodeid, 0.0) + LATE
        signal.signal(signal.SIGVTALRM, lambda *_: os._exit(1) if self.chosen else pytest.skip("it takes too long"))
        signal.setitimer(signal.ITIMER_VIRTUAL, late if self.chosen else self.longest)
        began = time.process_time()
        try:
            yield
            self.durations[item.nodeid] = time.process_time() - began
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.killer = report.nodeid


def run_tests(files: Sequence[str], tests: Tests) -> Tests:
    """Run test files in this process until one fails."""
    without = [f"-pno:{plugin}" for plugin in ("cacheprovider", "xdist", "unraisableexception", "threadexception")]
    known = "-Wignore::pytest.PytestAssertRewriteWarning"  # an earlier run in this process has imported the plugins
    code = pytest.main(
        [*without, known, "-q", "-x", "-m", "not slow and not realtime", "--tb=no", *files], plugins=[tests]
    )
    if code and not tests.killer:
        tests.killer = f"pytest ended with {code}"
    return tests


class Mutated(importlib.machinery.SourceFileLoader):
    """Imports one module from a changed source."""

    changed = ""

    def get_code(self, fullname: str) -> Any:
        return compile(self.changed, self.path, "exec")

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> importlib.machinery.ModuleSpec | None:
        return importlib.machinery.ModuleSpec(name, self, origin=self.path) if name == self.name else None


def forget(name: str) -> None:
    """Remove a module, and all that have imported it, from those that are loaded."""
    ours = {n: m for n, m in sys.modules.items() if n.split(".")[0] in ("drake_starnav", "tests", "conftest")}
    files = {n: m.__file__ for n, m in ours.items() if hasattr(m, "__file__") and m.__file__}
    uses = {n: _imported(Path(file)) for n, file in files.items()}
    stale, before = {name}, 0
    while len(stale) > before:
        before = len(stale)
        stale |= {user for user, used in uses.items() if used & stale}
    for module in stale | {n for n in ours if "test_" in n or "conftest" in n}:
        sys.modules.pop(module, None)


def _imported(file: Path) -> set[str]:
    """Names of modules, and of what is taken from them, that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def tried(loader: Mutated, files: Sequence[str], durations: dict[str, float], limit: float) -> dict[str, Any]:
    """What becomes of a mutant, in a fork of this process: `killer`, empty if it survives, and `durations`, s."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        _die_of_the_limits(limit)
        gc.disable()
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        sys.meta_path.insert(0, loader)
        try:
            importlib.import_module(loader.name)
            tests = run_tests(files, Tests(durations))
            result = {"killer": tests.killer, "durations": tests.durations}
        except BaseException as error:
            result = {"killer": f"import: {type(error).__name__}"}
        os.write(writer, json.dumps(result).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        answer = pipe.read()
    os.waitpid(child, 0)
    return json.loads(answer) if answer else {"killer": "takes too long or too much memory"}


def _die_of_the_limits(limit: float) -> None:
    """Let the system end this process after so much processor time, s, or when it takes too much memory."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 1))
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    most = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def scored(module: str, files: Sequence[str], count: int, seed: int) -> list[dict[str, Any]]:
    """The fate of a random draw of a module's mutants."""
    os.chdir(ROOT)
    path = ROOT / "drake_starnav" / f"{module}.py"
    source = path.read_text(encoding="utf-8")
    drawn = mutants(source)
    total = len(drawn)
    if total > count:
        drawn = sorted(random.Random(f"{seed} {module}").sample(drawn, count), key=lambda mutant: mutant.line)
    with contextlib.redirect_stdout(io.StringIO()):
        run_tests(files, Tests({}, WARM_UP))  # compiles and loads what stays
    name = "drake_starnav." + module.replace("/", ".")
    forget(name)
    numba.config.DISABLE_JIT = True
    loader = Mutated(name, str(path))
    loader.changed = source
    usual = tried(loader, files, {}, 600.0)
    if usual["killer"]:
        raise SystemExit(f"{module} itself does not pass its tests: {usual['killer']}")
    durations = usual["durations"]
    limit = SLOWER * sum(durations.values()) + LATE
    records = []
    for mutant in tqdm(drawn, desc=module, unit="mutant", disable=None, leave=False):
        loader.changed, began = mutant.source, time.perf_counter()
        facts = {"module": module, "of": total, "seed": seed, **mutant._asdict(), "killer": ""}
        del facts["source"]
        if not equivalent(facts):
            facts["killer"] = killer = tried(loader, files, durations, limit)["killer"]
            if killer in durations:
                durations[killer] *= 0.5  # what kills one mutant probably kills another
            if not killer:
                tqdm.write(f"{module}.py:{mutant.line}: {mutant.before}  ->  {mutant.after}")
                sys.stdout.flush()
        records.append({**facts, "seconds": round(time.perf_counter() - began, 2)})
    return records


def equivalent(record: dict[str, Any]) -> bool:
    """Whether a mutant is listed as one that behaves as the module does."""
    listed = yaml.safe_load(EQUIVALENT.read_text(encoding="utf-8"))[record["module"]]
    return any(record["before"] == entry["before"] and record["after"] in entry["after"] for entry in listed)


def report(records: list[dict[str, Any]]) -> tuple[str, bool]:
    """A line for each module and group, and whether all groups have enough kills."""
    lines: list[str] = []
    enough = True
    for group, modules in GROUPS.items():
        of_group = [r for r in records if r["module"] in modules]
        for module in modules:
            of_module = [r for r in of_group if r["module"] == module]
            if of_module:
                killed, counted = _score(of_module)
                same, spent = len(of_module) - counted, sum(r["seconds"] for r in of_module)
                counts = f"{killed} of {counted} killed, {same} equivalent, {of_module[0]['of']} possible"
                lines.append(f"  {module}: {counts}, {spent:.0f} s")
        if of_group:
            killed, counted = _score(of_group)
            enough &= killed >= WANTED * counted
            lines.append(f"{group}: {killed} of {counted} killed, {100.0 * killed / max(counted, 1):.1f} %")
    return "\n".join(lines), enough


def _score(records: list[dict[str, Any]]) -> tuple[int, int]:
    """Mutants that are killed, and those that should be."""
    killed = sum(bool(r["killer"]) for r in records)
    return killed, killed + sum(not r["killer"] and not equivalent(r) for r in records)


def main(arguments: Sequence[str] | None = None) -> int:
    """Mutate; see `--help`. Returns 1 where too few mutants are killed."""
    tests = {module: files for modules in GROUPS.values() for module, files in modules.items()}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", metavar="MODULE", help=f"of {', '.join(tests)}; default: all")
    parser.add_argument("--mutants", type=int, default=300, metavar="N", help="of each module at most; default: 300")
    parser.add_argument("--seed", type=int, default=0, help="of the draw; default: 0")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="modules at a time; default: 1")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write what became of each, one JSON a line")
    options = parser.parse_args(arguments)
    chosen = {m.removesuffix(".py").removeprefix("drake_starnav/"): None for m in options.modules} or tests
    if unknown := chosen.keys() - tests.keys():
        parser.error(f"unknown: {', '.join(unknown)}")
    records: list[dict[str, Any]] = []
    spawned = get_context("spawn")
    with ProcessPoolExecutor(options.jobs, mp_context=spawned, max_tasks_per_child=1) as pool:
        each = [pool.submit(scored, module, tests[module], options.mutants, options.seed) for module in chosen]
        for future in each:
            records += future.result()
            if options.out is not None:
                options.out.parent.mkdir(parents=True, exist_ok=True)
                options.out.write_text("".join(json.dumps(r) + "\n" for r in records), encoding="utf-8")
    text, enough = report(records)
    print(text)
    return 0 if enough else 1


if __name__ == "__main__":
    sys.exit(main())
