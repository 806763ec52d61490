"""The names of what is shipped are known without the numerics."""

import subprocess
import sys


def test_help_is_shown_before_anything_heavy_is_imported() -> None:
    code = (
        "import sys; from drake_starnav.cli.simulate import simulate\n"
        "try: simulate(['--help'])\n"
        "except SystemExit: pass\n"
        "print(*sorted({'numba', 'scipy', 'pydrake', 'tqdm'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "exit codes: 0" in done.stdout
    assert done.stdout.splitlines()[-1] == ""
