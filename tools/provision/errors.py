"""Errors of provisioning, each a sentence that names the remedy."""


class ProvisionError(Exception):
    """Shown as one line, without a traceback; exit status 1."""
