"""The size of the packages: one limit for all of them together, and a budget with some room for each."""

import io
import tokenize
from itertools import pairwise

from import_graph import FILES

#: Tokens that are no code; those of the first kind may stand anywhere.
BESIDE = {tokenize.COMMENT, tokenize.NL}
LAYOUT = {tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}

#: Lines and tokens of code of the three packages together at most; comments, docstrings and layout are no tokens.
LINES, TOKENS = 59_199, 434_698

#: Lines of each package at most, those of packages inside it apart: a tenth more than it has.
BUDGET = {
    "fem1d2d": 4900,
    "ndtheory": 6900,
    "verification": 1400,
    "verification.algorithm": 3650,
    "verification.bounds": 850,
    "verification.certificate": 2550,
    "verification.cli": 2800,
    "verification.constants": 1050,
    "verification.contact": 1100,
    "verification.coupling": 8850,
    "verification.exploration": 850,
    "verification.figures": 1800,
    "verification.free_norm": 1750,
    "verification.interface": 4900,
    "verification.ledger": 4950,
    "verification.machine": 300,
    "verification.output": 650,
    "verification.problem": 2700,
    "verification.reproduce": 800,
    "verification.sections": 1050,
    "verification.semidefinite": 3350,
    "verification.show": 450,
    "verification.sweeps": 2950,
    "verification.testing": 1750,
}


def tokens(source: str) -> int:
    """The number of tokens of a source without comments, docstrings and layout."""
    found = [kind for kind, *_ in tokenize.generate_tokens(io.StringIO(source).readline) if kind not in BESIDE]
    begun = [tokenize.INDENT, *found]  # a docstring is a string where a block or the module begins
    docstrings = sum(kind == tokenize.STRING and before == tokenize.INDENT for before, kind in pairwise(begun))
    return sum(kind not in LAYOUT for kind in found) - docstrings


def test_the_packages_together_keep_to_one_limit():
    texts = [path.read_text("utf-8") for path in FILES.values()]
    assert sum(len(text.splitlines()) for text in texts) <= LINES
    assert sum(map(tokens, texts)) <= TOKENS
    assert tokens('"""Two."""\n# a comment\nx = (1 +\n     2)\n') == 7


def test_no_package_is_longer_than_its_budget():
    lines = dict.fromkeys(BUDGET, 0)
    for module, path in FILES.items():
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        owner = package if package.startswith("verification") else package.partition(".")[0]
        lines[owner] = lines.get(owner, 0) + len(path.read_text("utf-8").splitlines())
    assert set(lines) == set(BUDGET)
    assert {package: count for package, count in lines.items() if count > BUDGET[package]} == {}
