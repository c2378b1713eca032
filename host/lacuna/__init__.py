"""lacuna: find what a model lacks. It names the mechanism that is missing, or says that none is, or that none fits."""

__version__ = "0.1.0"
