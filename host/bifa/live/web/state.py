"""What every page shows: one state, held by the server, with a version that grows with every change."""

from collections import deque
from collections.abc import Mapping
from typing import Any

SHOWN_S = 20.0


class LiveState:
    """`content` is all there is to show, as plain types; `samples` are those of the last SHOWN_S."""

    def __init__(self, **content: Any) -> None:
        self.version = 0
        self.content: dict[str, Any] = content
        self.samples: deque[dict[str, Any]] = deque()

    def change(self, changes: Mapping[str, Any], samples: list[dict[str, Any]] | None = None) -> dict[str, Any]:
        """Take over `changes`; the message that tells the pages, with the samples that are new."""
        self.version += 1
        self.content |= changes
        for sample in samples or []:
            if self.samples and sample["t"] < self.samples[-1]["t"]:  # the Uno has restarted
                self.samples.clear()
            self.samples.append(sample)
        while self.samples and self.samples[-1]["t"] - self.samples[0]["t"] > SHOWN_S:
            self.samples.popleft()
        return {"version": self.version, "state": self.content, "samples": samples or []}

    def whole(self) -> dict[str, Any]:
        """The message for a page that knows nothing yet, or whose samples are void."""
        return {"version": self.version, "state": self.content, "samples": list(self.samples), "whole": True}
