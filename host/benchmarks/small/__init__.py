"""Small systems of other kinds than robots, drawn from seeds; what each lacks is sealed.

`kinds/` one file a kind: the model with its candidates as its owner would write it, and the truth in other formulas.
`draw.py` makes a set of a seed, `instrument.py` measures it, `distinct.py` draws again what could not be told.
"""
