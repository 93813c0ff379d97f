"""Results of all commands, and how they are written.

`rows`: a quantity with its interval, and a finding with its code, severity, numbers, sentence and the change
of the scene that corrects it; the sentences are in `sentences.toml`.
`numbers`: values with their uncertainties as text.
`result`: the base of all results, texts in rows and columns, and how both are written in a terminal, a
notebook, a CSV file and JSON.
A new quantity is one `Quantity` where it is computed; a new finding one code, with one sentence.
"""
