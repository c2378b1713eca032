"""The kinds, one per file: a model as its owner writes it, and a truth with other formulas from the literature."""

from benchmarks.small.kinds import battery, chemical, drive, electrical, hydraulic, oscillator, thermal

KINDS = {
    module.KIND.key: module.KIND for module in (thermal, electrical, hydraulic, drive, oscillator, battery, chemical)
}
