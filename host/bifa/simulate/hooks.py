"""Where an effect may act: the hooks, and the chains of all effects' functions that the integrator calls.

An effect's file defines functions named after hooks. Their arguments are found by name: the effect's own
parameters, what the hook offers, and `state`, the number remembered for each actuator. Each chain calls
the active effects in alphabetical order; an effect costs one test of a bit while it is inactive.

What each hook returns, and in which unit, is in docs/adding-an-effect.md.
"""

from __future__ import annotations

import inspect

from bifa import effects
from bifa.effects import EffectError
from bifa.simulate import generated, layout

_STATEFUL = ("z", "actuator")
# hook: (arguments of the chain, offered to effects unless hidden; how the effects' results combine)
HOOKS: dict[str, tuple[tuple[str, ...], str]] = {
    "delay": (("to_positive",), "sum"),
    "supply": (("supply_psi", "now_s"), "replace"),
    "load": (("supply_psi", "conductance_per_s", "pull_psi_per_s", "positive"), "replace"),
    "line": ((*_STATEFUL, "z_new", "source_psi", "step_s"), "keep"),
    "filling": (("rate_per_s", "pressure_psi", "inlet_psi", "volume_share"), "replace"),
    "loss": (("pressure_psi",), "sum"),
    "area": (("stroke_share",), "product"),
    "air": (("area_ratio",), "product"),
    "play": ((*_STATEFUL, "position_m"), "replace"),
    "play_state": ((*_STATEFUL, "z_new", "position_m"), "state"),
    "spring": ((*_STATEFUL, "small", "direction", "step_s"), "pair"),
    "spring_state": ((*_STATEFUL, "z_new", "travel_m", "step_s"), "state"),
    "friction": (("coefficient", "static_coefficient", "sliding_m_s"), "replace"),
    "grip": (("direction",), "product"),
    "drag": (("distance_m",), "sum"),
    "incline": ((), "sum"),
    "slack": ((), "sum"),
    "sensed": (("pressure_psi", "source_psi"), "replace"),
    "sensor": ((*_STATEFUL, "before_psi", "after_psi", "step_s"), "follow"),
    "reading": (("pressure_psi",), "replace"),
    "stamp": ((), "sum"),
    "initial": ((*_STATEFUL, "position_m", "pressure_psi"), "first"),
}
HIDDEN = {"z", "z_new", "actuator"}


def chain_source() -> str:
    """Python source of one chain a hook over all effects of the library."""
    modules = effects.modules()
    lines = ['"""Generated from the library of effects; do not edit."""', "from numba import njit", ""]
    for name in modules:
        lines.append(f"import bifa.effects.{name} as {name}")
    lines.append("")
    users: dict[str, list[str]] = {}
    for hook in HOOKS:
        users[hook] = [name for name, module in modules.items() if inspect.isfunction(getattr(module, hook, None))]
        for name in users[hook]:
            lines.append(f'{hook}_of_{name} = njit(error_model="numpy")({name}.{hook})')
        lines.append(f"{hook.upper()} = {sum(1 << layout.effect_bit(name) for name in users[hook])}")
    idle = [name for name in modules if not any(name in names for names in users.values())]
    if idle:
        raise EffectError(f"{', '.join(idle)} acts nowhere: no function is named after a hook ({', '.join(HOOKS)})")
    for hook, names in users.items():
        lines += _chain(hook, names)
    return "\n".join(lines) + "\n"


def _chain(hook: str, names: list[str]) -> list[str]:
    arguments, combine = HOOKS[hook]
    value = {"sum": "total", "product": "total", "pair": "total, growth"}.get(combine, "")
    if combine in ("replace", "keep"):
        value = next(argument for argument in arguments if argument not in HIDDEN)
    body = {"sum": ["total = 0.0"], "product": ["total = 1.0"], "pair": ["total = 0.0", "growth = 0.0"]}.get(
        combine, []
    )
    for name in names:
        body.append(f"if active & {1 << layout.effect_bit(name)}:")
        body += ["    " + line for line in _call(hook, name, combine, value)]
    if combine == "follow":
        body.append("return after_psi")
    elif value:
        body.append(f"return {value}")
    signature = ", ".join(("active", "q", *arguments))
    return [
        "",
        "",
        '@njit(error_model="numpy", _nrt=False)',
        f"def {hook}({signature}):",
        *("    " + line for line in body or ["pass"]),
    ]


def _call(hook: str, name: str, combine: str, value: str) -> list[str]:
    effect = effects.library()[name]
    state = f"[{layout.state_slot(name)} + actuator]" if effect.states else None
    own = {parameter.name: f"q[{layout.index(f'{name}.{parameter.name}')}]" for parameter in effect.parameters}
    offered = {argument: argument for argument in HOOKS[hook][0] if argument not in HIDDEN}
    if state and "actuator" in HOOKS[hook][0]:
        offered["state"] = f"z{state}"
    given = []
    for argument in inspect.signature(getattr(effects.modules()[name], hook)).parameters:
        source = own.get(argument) or offered.get(argument)
        if source is None:
            raise EffectError(f"{name}.{hook} asks for {argument!r}; it may have {', '.join([*own, *offered])}")
        given.append(source)
    call = f"{hook}_of_{name}({', '.join(given)})"
    match combine:
        case "sum":
            return [f"total += {call}"]
        case "product":
            return [f"total *= {call}"]
        case "pair":
            return [f"force, slope = {call}", "total += force", "growth += slope"]
        case "replace":
            return [f"{value} = {call}"]
        case "keep":
            return [f"{value} = {call}", f"z_new{state} = {value}"]
        case "state":
            return [f"z_new{state} = {call}"]
        case "first":
            return [f"z{state} = {call}"]
        case _:  # follow: the next sensor of the chain sees this one's output
            return [f"before = z{state}", f"after_psi = {call}", f"z{state} = after_psi", "before_psi = before"]


chains = generated.load("chains", chain_source())
