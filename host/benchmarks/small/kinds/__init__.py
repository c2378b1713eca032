"""The kinds, one a file: a model as its owner writes it, and the truth as the literature has it otherwise."""

from benchmarks.small.kinds import battery, chemical, drive, electrical, hydraulic, oscillator, thermal

KINDS = {
    module.KIND.key: module.KIND for module in (thermal, electrical, hydraulic, drive, oscillator, battery, chemical)
}
