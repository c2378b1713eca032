"""Small systems other than robots, drawn from seeds; what each model lacks is sealed.

`kinds/` has one file per kind: the model with its candidates as its owner would write it, and the truth in other
formulas. `draw.py` draws a set from a seed, `instrument.py` measures it, `distinct.py` rejects undecidable sets.
"""
