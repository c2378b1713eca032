# SPDX-License-Identifier: GPL-3.0-or-later
"""The foreign truth: a robot and a bench that share no formula with bifa's model, its effects, or the plant.

    python -m virtual_robot.sealed --truth foreign --seed 7 --out runs/seven [--kind one|none|pair|outside]

Written from the literature (docs/truths.md) before the engine under test was changed, and frozen since.
"""

from virtual_robot.truths.foreign.day import Label, generate

__all__ = ["Label", "generate"]
