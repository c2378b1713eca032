# SPDX-License-Identifier: GPL-3.0-or-later
"""Robots that data sets are sealed of, one a folder, none of which shares an equation with another."""
