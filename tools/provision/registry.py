"""Whether PlatformIO's registry answers within a deadline; PlatformIO itself would wait for a minute."""

import queue
import threading
from collections.abc import Iterable

import requests
from platformio import __registry_mirror_hosts__ as registry_hosts

DEADLINE_S = 4.0


def package_urls() -> list[str]:
    """Addresses at which each mirror of the registry describes the package that is needed first."""
    return [f"https://api.{host}/v3/packages/platformio/platform/atmelavr" for host in registry_hosts]


def answers(urls: Iterable[str], deadline_s: float = DEADLINE_S) -> bool:
    """Return whether any of `urls` describes a package within `deadline_s` seconds in all.

    Name resolution ignores time-outs, so each address is queried in a thread that is abandoned if it hangs.
    """
    urls = list(urls)
    verdicts: queue.Queue[bool] = queue.Queue()
    for url in urls:
        threading.Thread(target=lambda url=url: verdicts.put(_describes_package(url, deadline_s)), daemon=True).start()
    timer = threading.Timer(deadline_s, lambda: [verdicts.put(False) for _ in urls])
    timer.daemon = True
    timer.start()
    try:
        return any(verdicts.get() for _ in urls)
    finally:
        timer.cancel()


def _describes_package(url: str, timeout_s: float) -> bool:
    try:
        reply = requests.get(url, timeout=timeout_s)
        return reply.status_code == 200 and "name" in reply.json()
    except (requests.RequestException, ValueError):
        return False
