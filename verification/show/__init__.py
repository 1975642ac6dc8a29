"""The parts of results as data: what a terminal, a notebook and the written report lay out.

Every result gives its sections: a title, sentences, and tables whose cells are words or numbers with unit and level.

>>> import verification as vf
>>> setting, constants, limits = vf.measure(vf.example("two-bars")).sections()
>>> constants.title
'WHICH CONSTANTS DOES THE THEOREM USE?'
>>> constants.parts[0].rows[0]  # doctest: +ELLIPSIS
('m', Quantity(value=0.7122..., text='0.712258', unit='Pa', level='float'), 'Pa', 'least energy (doubled) at norm 1')
"""
