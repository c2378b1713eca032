"""A dask cluster over TLS accepts only certificates of one's own authority."""

import subprocess
from pathlib import Path

import pytest

from bifa.cluster import ClusterError, Tls, cluster

distributed = pytest.importorskip("distributed")


def authority(folder: Path, name: str) -> Tls:
    """Certificate authority of that name, with one certificate shared by all parties (made by openssl)."""
    files = {part: folder / f"{name}.{part}" for part in ("ca", "cert", "key")}
    openssl = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}"]
    subprocess.run([*openssl, "-keyout", files["key"], "-out", files["cert"]], check=True, capture_output=True)
    files["ca"].write_bytes(files["cert"].read_bytes())
    return Tls(**files)


@pytest.fixture(scope="module")
def ours(tmp_path_factory) -> Tls:
    return authority(tmp_path_factory.mktemp("tls"), "ours")


@pytest.fixture(scope="module")
def address(ours):
    security = distributed.Security(
        tls_ca_file=str(ours.ca),
        **{f"tls_{who}_{part}": str(file) for who in ("client", "scheduler", "worker")
           for part, file in (("cert", ours.cert), ("key", ours.key))},
        require_encryption=True,
    )  # fmt: skip
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None, "processes": False}
    with distributed.LocalCluster(security=security, protocol="tls://", **options) as workers:
        yield workers.scheduler_address


def test_work_is_done_over_tls(ours, address):
    assert address.startswith("tls://")
    with cluster(address, ours) as (executor, count):
        assert (executor.submit(sum, [1, 2, 3]).result(), count) == (6, 1)


def test_a_certificate_of_another_authority_is_refused(tmp_path, address):
    with (
        pytest.raises(ClusterError, match="no dask scheduler answers"),
        cluster(address, authority(tmp_path, "others")),
    ):
        pass


def test_no_certificate_is_refused(address):
    with pytest.raises(ClusterError), cluster(address):
        pass


def test_certificates_do_not_travel_in_the_clear(ours):
    with pytest.raises(ClusterError, match="need an address tls://"), cluster("tcp://127.0.0.1:8786", ours):
        pass


def test_what_is_missing_is_said(ours, tmp_path):
    with pytest.raises(ClusterError, match="missing: --dask-key"):
        Tls(ours.ca, ours.cert).security()
    with pytest.raises(ClusterError, match=r"--dask-cert .*: no such file"):
        Tls(ours.ca, tmp_path / "none.pem", ours.key).security()
