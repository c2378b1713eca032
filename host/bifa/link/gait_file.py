"""Parameters from a TOML file: a gait as the rest of bifa writes it, and any other parameter of the Uno beside it."""

import tomllib
from pathlib import Path

from bifa.link.units import BY_NAME, ParameterError, to_wire

NOT_PARAMETERS = ("format", "provenance")
GAIT = ("period_s", "psi12_deg", "psi13_deg", "duty_body", "duty_head", "duty_tail")


def read_gait_file(path: str | Path) -> dict[str, float]:
    """The parameters in a file; the gait's six must be there. Raises ParameterError, which names what is wrong."""
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ParameterError(f"cannot read {path}: {error}") from None
    parameters = {name: value for name, value in document.items() if name not in NOT_PARAMETERS}
    unknown = [name for name in parameters if name not in BY_NAME]
    missing = [name for name in GAIT if name not in parameters]
    if unknown or missing:
        problem = f"does not know {', '.join(unknown)}" if unknown else f"lacks {', '.join(missing)}"
        raise ParameterError(f"{path}: a gait {problem}; the parameters are {', '.join(BY_NAME)}")
    for name, value in parameters.items():
        try:
            to_wire(name, value)
        except ParameterError as error:
            raise ParameterError(f"{path}: {error}") from None
    return parameters
