"""The hooks at which effects act, and the chains of effects' functions that the integrator calls.

An effect's file defines functions named after hooks. Their arguments are matched by name: the effect's own parameters,
the arguments that the hook offers, and `state`, the effect's state variable of each actuator. Each chain calls the
active effects in alphabetical order; an inactive effect costs one bit test.

docs/adding-an-effect.md lists what each hook returns, with units.
"""

import inspect

from bifa import effects
from bifa.effects import EffectError, PhysicalEffect
from bifa.simulate import generated, layout

_STATEFUL = ("z", "actuator")
# hook: (arguments of the chain, which are offered to effects unless hidden; how the effects' results are combined)
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
# How results are combined: the chain's initial statement, the statement of each call, and the value that the chain
# returns. `{value}` is the hook's first offered argument, `{state}` the index of the effect's state.
_COMBINED = {
    "sum": ("total = 0.0", "total += {call}", "total"),
    "product": ("total = 1.0", "total *= {call}", "total"),
    "pair": ("total = growth = 0.0", "force, slope = {call}; total += force; growth += slope", "total, growth"),
    "replace": ("", "{value} = {call}", "{value}"),
    "keep": ("", "{value} = {call}; z_new{state} = {value}", "{value}"),
    "state": ("", "z_new{state} = {call}", ""),
    "first": ("", "z{state} = {call}", ""),
    # The next sensor in the chain receives this one's output.
    "follow": ("", "before = z{state}; after_psi = {call}; z{state} = after_psi; before_psi = before", "after_psi"),
}


def chain_source() -> str:
    """Python source of the chains, one per hook, over all effects of the library."""
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
        raise EffectError(f"{', '.join(idle)} does not act: no function is named after a hook ({', '.join(HOOKS)})")
    writers = [hook for hook, (_, combine) in HOOKS.items() if "{state}" in _COMBINED[combine][1]]
    for name, effect in effects.library().items():
        if effect.states and not any(name in users[hook] for hook in writers):
            raise EffectError(f"{name} declares states=1, but its state never changes: define {' or '.join(writers)}")
    for hook, names in users.items():
        lines += _chain(hook, names)
    return "\n".join(lines) + "\n"


def _chain(hook: str, names: list[str]) -> list[str]:
    arguments, combine = HOOKS[hook]
    begin, each, result = _COMBINED[combine]
    value = next((argument for argument in arguments if argument not in HIDDEN), "")
    body = [begin] if begin else []
    for name in names:
        effect = effects.library()[name]
        if "{state}" in each and not effect.states:
            raise EffectError(f"{name}.{hook} returns a state: {name} must declare states=1")
        state = f"[{layout.effect_slots()[name]} + actuator]" if effect.states else ""
        body.append(f"if active & {1 << layout.effect_bit(name)}:")
        body.append("    " + each.format(call=_call(hook, effect, state), value=value, state=state))
    if result:
        body.append(f"return {result.format(value=value)}")
    signature = ", ".join(("active", "q", *arguments))
    return [
        "",
        "",
        '@njit(error_model="numpy", _nrt=False)',
        f"def {hook}({signature}):",
        *("    " + line for line in body or ["pass"]),
    ]


def _call(hook: str, effect: PhysicalEffect, state: str) -> str:
    """Source of the call of an effect's function; `state`: index of the actuator's state in `z`."""
    own = {parameter.name: f"q[{layout.index(f'{effect.name}.{parameter.name}')}]" for parameter in effect.parameters}
    offered = {argument: argument for argument in HOOKS[hook][0] if argument not in HIDDEN}
    if effect.states and "actuator" in HOOKS[hook][0]:
        offered["state"] = f"z{state}"
    given = []
    for argument in inspect.signature(getattr(effects.modules()[effect.name], hook)).parameters:
        if argument in own and argument in offered:
            raise EffectError(f"{effect.name}.{hook}: the hook offers {argument!r}, so no parameter can be called that")
        source = own.get(argument) or offered.get(argument)
        if source is None:
            raise EffectError(
                f"{effect.name}.{hook} has an unknown argument {argument!r}; it may take {', '.join([*own, *offered])}"
            )
        given.append(source)
    return f"{hook}_of_{effect.name}({', '.join(given)})"


chains = generated.load("chains", chain_source())
