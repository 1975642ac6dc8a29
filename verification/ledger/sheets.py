"""The ledger as a page of the site, and the errata sheet: generated from the rows, never typed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

from verification.ledger.evidence import Evidence, Method
from verification.ledger.rows import Finding, Ledger

#: By this our files are known (:mod:`verification.output.files`).
MARK = "<!-- ndtheory verify -->"

SECTIONS = (
    ("Section 2: the contact problem", "2."),
    ("Section 3: the algorithm", "3."),
    ("Section 4: the weak form", "4. norm-half prop-4 rem-4"),
    ("Section 5: convergence", ""),
    ("Sections 6 and 7: the experiments", "sec- fig-"),
    ("What the paper does not state", "x-"),
)

FAULTS = {
    "false as printed": "False as printed",
    "does not follow": "Steps that do not follow",
    "gap": "Gaps",
    "typo": "Errors of notation",
}

WORDS = {
    "PROVED": "derived in exact arithmetic for all admissible values, from the rows it uses",
    "REPAIRED": "wrong or incomplete as printed; the repaired form is proved, exactly or in words",
    "REFUTED": "wrong as printed, and no repaired form is known",
    "NUMERICAL": "holds in floating point on every problem tried, or in readings that the row names",
    "ASSUMED": "a definition, a law of the model or a cited result",
    "INCONCLUSIVE": "the evidence does not decide",
}


#: Kinds of evidence: at which level their numbers are, and what they are.
METHODS: Mapping[Method, tuple[str, str]] = {
    "symbolic": ("exact", "exact arithmetic for all admissible values, or an exact counterexample"),
    "dimension": ("exact", "the units of both sides"),
    "verified": (
        "verified",
        "both sides on one problem, each between proved bounds or rational; what fails so is refuted by proof",
    ),
    "discrete": ("float", "both sides in floating point on many problems"),
    "reading": ("-", "a definition, a result of others, a proof in words or one case computed exactly"),
}

#: Why statements that were checked in floating point have no evidence of the kind *verified*, by prefixes of their ids;
#: the last reason applies to all others.
NOT_VERIFIED = (
    ("fig- sec- x-no-theta x-incr", "it is about how many steps runs take, or where a stress changes its sign"),
    ("x-printed-false", "it is about all pairs of bodies; what it says is proved on one under (5.30) to (5.44)"),
    ("lemma-5.2 thm-", "it is about the limit of a run"),
    ("", "it is about solutions for given loads and every test function; residuals are evaluated in floating point"),
)


def _not_verified(ledger: Ledger) -> list[str]:
    """The table of those reasons."""
    found: dict[str, list[str]] = {}
    for row in ledger.rows:
        methods = {e.method for e in row.evidence}
        if "discrete" in methods and "verified" not in methods:
            id = row.statement.id
            reason = next(why for prefixes, why in NOT_VERIFIED if any(map(id.startswith, prefixes.split() or [""])))
            found.setdefault(reason, []).append(f"`{id}`")
    if not found:
        return []
    head = ["Some statements were checked only in floating point:", "", "| statements | why |", "|---|---|"]
    return [*head, *(f"| {', '.join(ids)} | {why} |" for why, ids in found.items()), ""]


def _section(id: str) -> str:
    for title, prefixes in SECTIONS:
        if any(id.startswith(prefix) for prefix in prefixes.split()):
            return title
    return SECTIONS[3][0]


def page(ledger: Ledger) -> str:
    """Every row with its evidence, in MyST Markdown."""
    count = f"{len(ledger.rows)} statements" if len(ledger.rows) > 1 else "One statement"
    lines = ["# The ledger: every numbered statement, checked", ""]
    lines += [
        f"{count}, evidence at the level *{ledger.level}*; run it again with `ndtheory verify`."
        " Floating point proves nothing here: it makes a row numerical at best. What is wrong in the paper stands on"
        " one page, the errata.",
        "",
        "| verdict | rows | means |",
        "|---|---|---|",
        *(f"| {verdict} | {count} | {WORDS[verdict]} |" for verdict, count in ledger.counts.items()),
        "",
    ]
    lines += ["| kind of evidence | level | is |", "|---|---|---|"]
    lines += [f"| {method} | {level} | {means} |" for method, (level, means) in METHODS.items()]
    lines += ["", "A level says what is known of the numbers: the glossary explains all four.", ""]
    lines += _not_verified(ledger)
    current = ""
    for row in ledger.rows:
        section = _section(row.statement.id)
        if section != current:
            lines += [f"## {section}", ""]
            current = section
        lines += [*_entry(row), ""]
    return "\n".join([*lines, MARK])


def _entry(row: Finding) -> Iterable[str]:
    s = row.statement
    label = "" if s.kind == "own" else f"{s.label} "
    yield f"### {label}{s.title}: {row.verdict}"
    yield ""
    yield f"`{s.id}`. {s.claims}"
    if s.leans_on:
        yield "Uses " + ", ".join(f"`{id}`" for id in s.leans_on) + "."
    if s.fault:
        yield ""
        inherited = f" (inherited from `{s.same_as}`)" if s.same_as else ""
        mended = f" **Repaired:** {s.repair} **Proof:** {s.proof}" if s.repair else ""
        yield f"*{s.fault.capitalize()}*{inherited}. {s.wrong}{mended}"
    yield ""
    for e in row.evidence:
        text = f"`{e.text}`" if e.method in ("symbolic", "dimension") else e.text  # formulas as code
        yield f"- *{e.method}*, {e.of}, {outcome(e)}: {text}{_counterexample(e)}"
    if s.note:
        yield ""
        yield s.note


OUTCOME = {True: "holds", False: "false", None: "undecided"}


def outcome(evidence: Evidence) -> str:
    """Outcome of a piece of evidence, in words."""
    only = " only in readings that depart from the text" if evidence.data.get("departs") else ""
    return OUTCOME[evidence.holds] + only


def _counterexample(evidence: Evidence) -> str:
    at = evidence.data.get("counterexample")
    return f" Counterexample: {', '.join(f'`{name} = {value}`' for name, value in at.items())}." if at else ""


def errata(ledger: Ledger) -> str:
    """The errors in the paper by kind, for its authors: one line each, in MyST Markdown."""
    faulty = [row for row in ledger.rows if row.statement.fault]
    lines = [
        "# Errata",
        "",
        "G. Bayada, J. Sabil, T. Sassi, *Convergence of a Neumann-Dirichlet algorithm for two-body contact problems"
        " with non local Coulomb's friction law*, ESAIM: M2AN 42 (2008) 243-262. What follows mends the statement of"
        " the theorem and its proof. Each entry was decided by an exact counterexample, on random problems or by"
        " reading; the ledger has the proof of each repair.",
        "",
        *(
            f"{s.title}: {s.claims} (`{s.id}`, {row.verdict} in the ledger.)\n"
            for row in ledger.rows
            if (s := row.statement).id == "x-printed-rescued"
        ),
    ]
    for fault, heading in FAULTS.items():
        own = [row for row in faulty if row.statement.fault == fault and not row.statement.same_as]
        if not own:
            continue
        lines += [f"## {heading}", ""]
        for row in own:
            s = row.statement
            also = [r.statement.label for r in faulty if r.statement.same_as == s.id]
            heirs = f" The same fault in {', '.join(also)}." if also else ""
            shown = [e for e in row.evidence if e.holds is False and e.of == "printed" and fault == "false as printed"]
            at = next((_counterexample(e) for e in shown if "counterexample" in e.data), "")
            mended = f" *Read:* {s.repair}" if s.repair else ""
            lines.append(f"- **{s.label}.** {s.wrong}{at}{mended}{heirs}")
        lines.append("")
    return "\n".join([*lines, MARK])


def verdicts(ledger: Ledger) -> str:
    """The verdicts by statement, as a JSON document."""
    found = {row.statement.id: row.verdict for row in ledger.rows}
    return json.dumps({"schema": "ndtheory.verdicts/1", "verdicts": found}, indent=2)
