"""The ledger: every numbered statement of the paper, its evidence and its verdict."""

from ndtheory.statements import quote
from verification.ledger.evidence import Evidence
from verification.ledger.rows import Ledger, Row, verify

__all__ = ["Evidence", "Ledger", "Row", "quote", "verify"]
