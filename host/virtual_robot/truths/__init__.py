# SPDX-License-Identifier: GPL-3.0-or-later
"""Robots for sealed data sets, one per folder; no two of them share an equation."""
