"""Run trials on a Dask cluster."""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.trial_file import find_versions
from drake_starnav.evaluation.workers import Pool

TIMEOUT = 10.0
"""Time limit for the scheduler's answer and for the first worker, s."""
LEAST_IN_FLIGHT = 1000
"""Least number of trials submitted at a time, so that new workers of a growing cluster find work."""


@contextmanager
def connect_dask_pool(address: str) -> Iterator[Pool]:
    """Workers of a Dask cluster. If a worker is lost, the scheduler assigns its trial to another one.

    Args:
        address: of the scheduler, e.g. `tcp://10.0.0.1:8786`.

    Raises:
        StarnavError: Dask is not installed, there is no cluster at the address, it has no workers, or their versions
            differ from this process's.
    """
    try:
        from distributed import Client
    except ImportError:
        raise StarnavError("Dask is not installed; allowed: pip install 'drake-starnav[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        try:
            client = stack.enter_context(Client(address, timeout=TIMEOUT))
        except Exception as error:  # any kind: the server there may speak another protocol
            reason = error if isinstance(error, (OSError, ValueError)) else "something else answers"
            raise StarnavError(
                f"--dask {address}: no Dask scheduler there ({reason}); allowed: the address of a running one, "
                "e.g. tcp://10.0.0.1:8786"
            ) from None
        thread_count = _check_workers(client, address)
        executor = client.get_executor(pure=False)
        yield Pool(lambda: nullcontext(executor), max(2 * thread_count, LEAST_IN_FLIGHT), thread_count)


def _check_workers(client: Any, address: str) -> int:
    """The number of the workers' threads; raises `StarnavError` unless every worker runs the same code as this."""
    try:
        client.wait_for_workers(1, timeout=TIMEOUT)
        versions_found = client.run(find_versions)
    except TimeoutError:
        raise StarnavError(f"--dask {address}: the scheduler has no workers; allowed: at least one") from None
    except ImportError as error:
        raise StarnavError(f"--dask {address}: {error} on a worker; allowed: the same installation as here") from None
    own_versions = find_versions()
    for worker, worker_versions in versions_found.items():
        other = [
            f"{name} {worker_versions.get(name)}, here {value}"
            for name, value in own_versions.items()
            if worker_versions.get(name) != value
        ]
        if other:
            raise StarnavError(f"--dask {address}: worker {worker} has {'; '.join(other)}; allowed: the same versions")
    return sum(client.nthreads().values())
