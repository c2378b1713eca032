"""The three chambers keep their colours in every figure."""

CHAMBERS = ("body", "head", "tail")
# Okabe and Ito's palette: distinct for readers with any colour vision, and on paper.
CHAMBER_COLOURS = {"body": "#0072B2", "head": "#D55E00", "tail": "#009E73"}
