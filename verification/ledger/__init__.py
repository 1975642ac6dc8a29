"""The ledger: every numbered statement of the paper, its evidence and its verdict."""

from ndtheory.statements import quote
from verification.ledger.evidence import Evidence
from verification.ledger.rows import Finding, Ledger, verify

__all__ = ["Evidence", "Finding", "Ledger", "quote", "verify"]
