"""A dask cluster as a `concurrent.futures.Executor`, for work that outgrows one machine.

Both ends unpickle what the other sends: whoever answers at the address can run code here, and whoever reaches the
scheduler can run code there. With TLS both have to present a certificate signed by your own authority.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bifa.errors import BifaError

HELP = (
    "Address of a dask scheduler, to use its workers. Both ends run what the other sends (pickle): use only one that "
    "you trust, and over a network only with TLS (tls://...)."
)
CA_HELP = "For --dask tls://...: certificate (PEM) of the authority that must have signed the cluster's certificate."
CERT_HELP = "For --dask tls://...: the certificate (PEM) that this computer presents."
KEY_HELP = "For --dask tls://...: the key of --dask-cert."


class ClusterError(BifaError):
    """The cluster cannot be used; the text says what to do."""


@dataclass(frozen=True)
class Tls:
    """The three PEM files that distributed needs; if all are None, its own configuration applies
    (`distributed.comm.tls` in dask's YAML files or `DASK_DISTRIBUTED__COMM__TLS__...`)."""

    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None

    def security(self) -> Any:
        """Return the security settings for distributed, or None to leave them to its own configuration. Raises
        ClusterError if a file is missing."""
        files = {"--dask-ca": self.ca, "--dask-cert": self.cert, "--dask-key": self.key}
        given = {name: file for name, file in files.items() if file is not None}
        if not given:
            return None
        if missing := [name for name in files if name not in given]:
            raise ClusterError(f"TLS needs {', '.join(files)} together; missing: {', '.join(missing)}")
        for name, file in given.items():
            if not file.is_file():
                raise ClusterError(f"{name} {file}: no such file")
        from distributed.security import Security

        return Security(
            tls_ca_file=str(self.ca),
            tls_client_cert=str(self.cert),
            tls_client_key=str(self.key),
            require_encryption=True,
        )


@contextmanager
def cluster(address: str, tls: Tls = Tls()) -> Iterator[tuple[Executor, int]]:
    """Connect to the cluster whose scheduler is at `address`; yields its executor and its number of threads. Raises
    ClusterError if that fails."""
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError("--dask needs the package distributed: pip install 'bifa[dask]'") from None
    security = tls.security()
    if security is not None and not address.startswith("tls://"):
        raise ClusterError(f"--dask-ca, --dask-cert and --dask-key need an address tls://..., not {address}")
    try:
        client = Client(address, timeout="10s", security=security)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # also if certificates do not match
        raise ClusterError(
            f"no dask scheduler answers at {address}: {error}; start one with `dask scheduler`"
        ) from None
    with client:
        count = sum(client.nthreads().values())
        if not count:
            raise ClusterError(
                f"the dask scheduler at {address} has no workers; start some with `dask worker {address}`"
            )
        # Code is compiled once per process. Equal calls give equal results, but caching them is not worth it.
        with client.get_executor(pure=False) as executor:
            yield executor, count
