"""The recorded verdicts, and the statements as pages and screens quote them.

Pages and screens take verdicts and texts from here, so that none of them contradicts another or the ledger.
"""

from __future__ import annotations

from ndtheory.statements import statements

#: The texts of a statement that may be quoted.
TEXTS = ("title", "claims", "wrong", "repair", "proof", "note")


def recorded() -> dict[str, str]:
    """The recorded verdicts by id."""
    return {id: statement.verdict for id, statement in statements().items() if statement.verdict}


def quote(id: str, what: str = "verdict") -> str:
    """The recorded verdict on a statement, or one of its texts.

    Parameters
    ----------
    id : str
        Of the statement.
    what : str
        'verdict', or a text: 'title', 'claims', 'wrong', 'repair', 'proof', 'note', with formulas in TeX.

    Raises
    ------
    ValueError
        No such statement, or it has no such text.

    Examples
    --------
    >>> quote("5.12"), quote("5.12", "title")
    ('PROVED', 'Both obstacle problems added')
    """
    if id not in statements():
        raise ValueError(f"{id!r}: no such statement")
    if what == "verdict":
        return recorded()[id]
    text: str = getattr(statements()[id], what) if what in TEXTS else ""
    if not text:
        raise ValueError(f"{what!r} of {id}: needed 'verdict' or one of {', '.join(TEXTS)} that is not empty")
    return text


def on_the_printed_proof() -> str:
    """Sentences of screens and reports on the printed proof where m < 1."""
    rescued = "x-printed-rescued"
    return (
        f"The printed proof needs m >= 1: it rests on (5.30), whose verdict in the ledger is {quote('5.30')}."
        f"  {quote(rescued, 'title')}, for M >= 2 m, by another estimate, whose verdict is {quote(rescued)}."
        f"  See: ndtheory verify 5.30 {rescued}"
    )
